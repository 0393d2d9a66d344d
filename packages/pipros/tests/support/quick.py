"""The tests that `script/test --quick` runs: those of touched packages, and chosen ones.

pytest's option `--quick` leaves out other files of a folder, some of which need what an installation lacks.
`python -m tests.support.quick` prints the folders and files to pass to pytest. With files that
`script/test --outcomes-to=FILE` wrote, it chooses again, and writes the files to tests/quick.txt.
`python -m tests.support.quick gate FILE…` fails if running them all takes more than `PROCESSOR_S`.
"""

import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.outcomes import Outcome, read_outcomes

LIST = file_of_tests("quick.txt")
PROCESSOR_S = 60
_COUNT = 1000
_PARTS = ("/tests/unit/", "/tests/graph/", "/tests/tree/")
_DEAR_S = 0.1
"""Files whose tests take more processor time each, on average, are not chosen."""


def add_options(parser: pytest.Parser) -> None:
    """Add the option `--quick`."""
    parser.addoption("--quick", action="store_true", help="leave out the files that tests/quick.txt lacks")


@cache
def listed() -> tuple[str, ...]:
    """Return the files of tests/quick.txt."""
    return tuple(line for line in LIST.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))


def leaves_out(config: pytest.Config, path: Path) -> bool:
    """Return whether `--quick` leaves out a file."""
    if not config.getoption("--quick") or path.suffix != ".py":
        return False
    return path.relative_to(REPOSITORY).as_posix() not in listed()


def changed() -> list[str]:
    """Return the files in which the working tree differs from its commit; none without git."""
    command = [
        "git", "-c", "core.quotePath=off", "status", "--porcelain", "--untracked-files=all", "--no-renames",
    ]  # fmt: skip
    try:
        ended = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return []
    return [line[3:].strip('"') for line in ended.stdout.splitlines()]


def tests_of(path: str) -> str | None:
    """Return the file or folder with the tests of a file of the tree, or None if nothing belongs to it alone.

    A test belongs to itself; a module, to the deepest folder of unit tests that is named like one of its
    folders; another file of a package other than the core, to all unit tests of this package.
    """
    top, package, part, *folders, name = Path(path).parts if path.count("/") > 2 else ("", "", "", "")
    if top not in ("packages", "plugins"):
        return None
    if part == "tests":
        is_test = name.startswith("test_") and name.endswith(".py")
        return path if is_test and Path(REPOSITORY, path).is_file() else None
    unit = Path(REPOSITORY, top, package, "tests", "unit")
    named = folders[1:] if part == "src" else []
    deepest = next(
        (folder for end in range(len(named), 0, -1) if (folder := unit.joinpath(*named[:end])).is_dir()), unit
    )
    if not deepest.is_dir() or (deepest == unit and package == "pipros"):
        return None
    return str(deepest.relative_to(REPOSITORY))


def to_run(paths: Iterable[str]) -> list[str]:
    """Return what to pass to pytest if these files changed, each test once."""
    chosen = sorted({*listed(), *filter(None, map(tests_of, paths))})
    return [path for path in chosen if not any(path.startswith(f"{other}/") for other in chosen)]


def choose(outcomes: Sequence[Outcome]) -> list[str]:
    """Return at least a thousand tests, as files: of every folder, those that take least for each test."""
    files: defaultdict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        file = outcome.test.partition("::")[0]
        if outcome.result == "passed" and any(part in file for part in _PARTS):
            files[file].append(outcome)
    folders: defaultdict[str, list[str]] = defaultdict(list)
    for file in files:
        folders[file.rpartition("/")[0]].append(file)
    share = _COUNT / sum(map(len, files.values()))
    return sorted(file for folder in folders.values() for file in _quickest(folder, files, share))


def _quickest(folder: Sequence[str], files: dict[str, list[Outcome]], share: float) -> Iterator[str]:
    wanted = share * sum(len(files[file]) for file in folder)
    cost = {file: sum(outcome.processor_s for outcome in files[file]) / len(files[file]) for file in folder}
    for file in sorted(folder, key=lambda file: (cost[file], file)):
        if wanted <= 0 or cost[file] > _DEAR_S:
            return
        yield file
        wanted -= len(files[file])


def gate(outcomes: Iterable[Outcome]) -> int:
    """Print the processor time of collecting and running the listed tests. Return 1 if it is too long."""
    import resource  # Windows lacks it, and imports this module

    collect = [sys.executable, "-m", "pytest", "-q", "--quick", "--collect-only", "-p", "no:cacheprovider"]
    code = subprocess.call([*collect, *listed()], cwd=REPOSITORY, stdout=subprocess.DEVNULL)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    ran = [outcome for outcome in outcomes if outcome.test.partition("::")[0] in listed()]
    taken = 2 * (used.ru_utime + used.ru_stime) + sum(outcome.processor_s for outcome in ran)  # two workers
    print(f"script/test --quick: {len(ran)} tests, {taken:.0f} s of processor time, of at most {PROCESSOR_S}")
    return code or int(taken > PROCESSOR_S or len(ran) < _COUNT)


if __name__ == "__main__":
    is_gate = sys.argv[1:2] == ["gate"]
    found = [outcome for file in sys.argv[1 + is_gate :] for outcome in read_outcomes(Path(file))]
    if is_gate:
        sys.exit(gate(found))
    if found:
        head = (
            "# Chosen by `python -m tests.support.quick FILE…`: see packages/pipros/tests/support/quick.py.\n"
        )
        LIST.write_text(head + "".join(f"{file}\n" for file in choose(found)), encoding="utf-8")
    else:
        print(" ".join(to_run(changed())))
