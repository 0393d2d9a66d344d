"""Check that tests notice faults: apply each mutation of tests/mutations.toml, and run its tests.

`python -m tests.support.mutations [WORD…]` tries all mutations, or those whose names contain a word. They are
applied to a copy of the tree, with a virtual environment in which the copy is installed, so that programs
that the tests start contain the fault, too.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.outcomes import read_outcomes
from tests.support.project import load_toml

TABLE = file_of_tests("mutations.toml")
_IMPORTED = "import pipros, rospy; print(pipros.__file__, rospy.__file__, sep='\\n')"


class MutationError(Exception):
    """A mutation does not apply, or tests fail without one."""


@dataclass(frozen=True, slots=True)
class Mutation:
    """A fault, and the tests that must fail because of it.

    Attributes:
        file: path of a source file in the repository, which contains the text `old` once.
        tests: files, folders or node ids, as on the command line of pytest.
    """

    name: str
    file: str
    old: str
    new: str
    tests: Sequence[str]

    def applied(self, text: str) -> str:
        """Return the text of the file with the fault.

        Raises:
            MutationError: `old` does not occur, occurs more than once, or equals `new`.
        """
        if (count := text.count(self.old)) != 1 or self.old == self.new:
            raise MutationError(f"{self.name}: {self.file} must contain the old text once, got {count}")
        return text.replace(self.old, self.new)


def read_mutations(file: Path = TABLE) -> list[Mutation]:
    """Return the mutations of a table."""
    return [Mutation(**entry) for entry in load_toml(file)["mutation"]]


def copy_tree(folder: Path) -> Path:
    """Copy the files of the work tree that git does not ignore. Return the copy's Python interpreter."""
    command = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    listed = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
    for name in listed.split("\0"):
        if name and (REPOSITORY / name).exists():  # it may have been deleted
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / name, folder / name)
    base = {"PYTHON": sys._base_executable, "VENV": ".venv"}  # type: ignore[attr-defined]
    subprocess.run([folder / "script" / "venv", "dev"], check=True, env=os.environ | base)
    python = folder / ".venv" / "bin" / "python"
    imported = subprocess.run([python, "-c", _IMPORTED], check=True, capture_output=True, text=True, cwd="/")
    if not all(Path(each).is_relative_to(folder) for each in imported.stdout.split()):
        raise MutationError(f"not the copy is imported: {imported.stdout}")
    return python


def run_tests(folder: Path, python: Path, tests: Sequence[str], *options: str) -> tuple[int, int]:
    """Run tests in a folder. Return how many failed, and how many ran.

    Raises:
        MutationError: pytest could not run them.
    """
    file = folder / "outcomes"
    file.unlink(missing_ok=True)
    command = (
        str(python),
        "-m",
        "pytest",
        "-q",
        "--tb=no",
        "-p",
        "no:cacheprovider",
        f"--outcomes-to={file}",
    )
    ended = subprocess.run(
        [*command, *options, *tests], cwd=folder, check=False, capture_output=True, text=True
    )
    if ended.returncode > 1:
        raise MutationError(f"pytest ended with {ended.returncode}: {ended.stdout[-500:]}{ended.stderr}")
    results = [outcome.result for outcome in read_outcomes(file)]
    return results.count("failed"), len(results)


def judge(mutation: Mutation, folder: Path, python: Path) -> tuple[int, int]:
    """Apply a mutation in a folder, run its tests, and undo it. Return the same as `run_tests`.

    Raises:
        MutationError: it does not apply, or its tests cannot run.
    """
    file = folder / mutation.file
    text = file.read_text(encoding="utf-8")
    try:
        file.write_text(mutation.applied(text), encoding="utf-8")
        _delete_compiled(file)
        return run_tests(folder, python, mutation.tests)
    finally:
        file.write_text(text, encoding="utf-8")
        _delete_compiled(file)


def _delete_compiled(file: Path) -> None:
    """Delete what was compiled, which looks up to date after a change of the same size within a second."""
    Path(importlib.util.cache_from_source(str(file))).unlink(missing_ok=True)


def main(words: Sequence[str]) -> int:
    chosen = [each for each in read_mutations() if not words or any(word in each.name for word in words)]
    if not chosen:
        print(f"no mutation in {TABLE} has a name with {' or '.join(words)}", file=sys.stderr)
        return 2
    tests = sorted({test for each in chosen for test in each.tests})
    noticed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        python = copy_tree(folder)
        failed, total = run_tests(folder, python, tests, "-n", str(os.cpu_count()))
        print(f"without a mutation: failed {failed} of {total}", flush=True)
        for each in chosen:
            try:
                failed_with, run = judge(each, folder, python)
                print(f"{each.name}: failed {failed_with} of {run}", flush=True)
                noticed += failed_with > 0
            except MutationError as error:
                print(error, flush=True)
    print(f"{noticed} of {len(chosen)} mutations are noticed")
    return int(failed > 0 or noticed < len(chosen))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
