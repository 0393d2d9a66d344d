"""The tests that `script/test --quick` runs, according to tests/quick.txt.

`python -m tests.support.quick` prints the folders and files to pass to pytest. With pytest's option
`--quick`, the slow tests in them are deselected.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY, TESTS

LIST = TESTS / "quick.txt"
_BASES = ("packages/*/tests/tree", "packages/*/tests/unit")


def listed(sign: str) -> list[str]:
    """Return the entries with the sign `+` (also run) or `-` (slow): files, or tests without parameters."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    return [line[2:] for line in lines if line.startswith(f"{sign} ")]


def add_options(parser: pytest.Parser) -> None:
    """Add the option `--quick`."""
    parser.addoption("--quick", action="store_true", help="leave out the slow tests of tests/quick.txt")


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Remove the slow tests from `items` if `--quick` is given."""
    if not config.getoption("--quick"):
        return
    slow = set(listed("-"))

    def is_slow(item: pytest.Item) -> bool:
        test = item.nodeid.partition("[")[0]
        return test in slow or test.partition("::")[0] in slow

    config.hook.pytest_deselected(items=[item for item in items if is_slow(item)])
    items[:] = [item for item in items if not is_slow(item)]


def missing() -> list[str]:
    """Return the entries of tests/quick.txt whose file or function does not exist."""
    found = []
    for entry in [*listed("+"), *listed("-")]:
        file, *names = entry.split("::")
        path = Path(REPOSITORY, file)
        if not path.is_file() or not all(name in path.read_text(encoding="utf-8") for name in names):
            found.append(entry)
    return found


if __name__ == "__main__":
    folders = [str(path.relative_to(REPOSITORY)) for base in _BASES for path in sorted(REPOSITORY.glob(base))]
    print(" ".join([*folders, *listed("+")]))
