"""Draw faults from the syntax trees of the sources, and count those that tests notice.

`python -m tests.support.mutants [--count 300] [--seed 1] [PYTEST_ARGUMENT…]` draws places in functions, in
proportion to their number in each folder. In copies of the tree, with environments in which the copies are
installed, one run of the tests notes which of them pass through each place; it counts as if it were right.
Then the place is changed, as in common mistakes, and these tests run again, the fastest first, until one
fails. The arguments choose the tests, as on the command line of pytest.
"""

import argparse
import ast
import copy
import importlib.util
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Queue
from typing import Any

from tests.support.environments import REPOSITORY, ROOTS
from tests.support.outcomes import read_outcomes

TESTS_S, TESTS_COUNT = 40.0, 60
"""At most this many seconds, and this many tests, are tried with a fault."""
LIMIT_S = 4 * TESTS_S
"""A fault is noticed if the tests have not ended by then."""
_PAIRS = (
    *((ast.Lt, ast.LtE), (ast.Gt, ast.GtE), (ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn)),
    *((ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.FloorDiv, ast.Mod), (ast.LShift, ast.RShift)),
    *((ast.BitAnd, ast.BitOr), (ast.And, ast.Or)),
)
_OTHER: dict[type[ast.AST], type[ast.AST]] = {a: b for x, y in _PAIRS for a, b in ((x, y), (y, x))}
_NOT_RUN = (ast.JoinedStr, ast.pattern, ast.arguments)
"""Parts of a function whose nodes are not drawn: their positions are wrong, or they are no expressions."""
_PROBE = '(__import__("builtins").__dict__.get("_passed_through", int)({number}), {text})[1]'
_MODULE = '''
"""Notes which test passes through a place, also in the programs that a test starts."""
import builtins, os
folder, running, known = {folder!r}, None, set()

def starts(nodeid, location):
    global running
    running = nodeid
    with open(os.path.join(folder, "running." + str(os.getpid())), "w") as file:
        file.write(nodeid)

def of_ancestor(pid):
    while pid > 1:
        try:
            with open(os.path.join(folder, "running." + str(pid))) as file:
                return file.read()
        except OSError:
            pass
        try:
            with open("/proc/%d/stat" % pid) as file:
                pid = int(file.read().rpartition(")")[2].split()[1])
        except OSError:
            break
    return ""

def passed_through(number):
    global running
    if running is None:
        running = of_ancestor(os.getpid())
    if running and (number, running) not in known:
        known.add((number, running))
        with open(os.path.join(folder, str(number)), "a") as file:
            file.write(running + "\\n")

builtins._passed_through = passed_through
'''
_MODULES = {
    "passed_through.py": _MODULE,
    "passed_through.pth": "import passed_through\n",
    "note_tests.py": "from passed_through import starts as pytest_runtest_logstart\n",
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """A fault: in the file of this path in the repository, the bytes from `start` to `end` become `new`."""

    file: str
    line: int
    start: int
    end: int
    old: str
    new: str

    @property
    def folder(self) -> str:
        """The package, and the folder of its sources that has the file."""
        parts = self.file.split("/")[1:-1]
        return "/".join(parts[:1] + parts[3:4])

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {' '.join(self.old.split())} -> {' '.join(self.new.split())}"


def changed(node: ast.AST) -> Iterator[tuple[ast.AST, ast.AST]]:
    """Yield the nodes to replace, and what replaces each."""
    match node:
        case ast.Compare(ops=[op]) | ast.BinOp(op=op) | ast.BoolOp(op=op) if other := _OTHER.get(type(op)):
            result: Any = copy.copy(node)
            if isinstance(node, ast.Compare):
                result.ops = [other()]
            else:
                result.op = other()
            yield node, result
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield node, operand
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            if not isinstance(test, ast.Compare | ast.BoolOp | ast.UnaryOp | ast.Constant):
                yield test, ast.UnaryOp(ast.Not(), test)
        case ast.Constant(value=bool() as value):
            yield node, ast.Constant(not value)
        case ast.Constant(value=int() as value):
            yield node, ast.Constant(value + 1)
        case ast.Constant(value=float() as value):
            yield node, ast.Constant(value * 1.1 or 1.0)
        case ast.Return(value=ast.AST() as value) if not isinstance(value, ast.Constant):
            yield value, ast.Constant(None)
        case ast.Expr(value=ast.Call() as call):
            yield call, ast.Constant(None)


def run_nodes(node: ast.AST, inside: bool = False) -> Iterator[ast.AST]:
    """Yield the nodes that run when a function is called."""
    if inside:
        yield node
    for name, value in ast.iter_fields(node):
        is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if name in ("annotation", "returns", "decorator_list", "bases", "keywords" if not inside else ""):
            continue
        for child in value if isinstance(value, list) else (value,):
            if isinstance(child, ast.AST) and not isinstance(child, _NOT_RUN):
                yield from run_nodes(child, inside or (is_function and name == "body"))


def mutants_of(file: Path) -> list[Mutant]:
    """Return all faults of a file."""
    text = file.read_bytes()
    starts = [0]
    for line in text.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    found = []
    for node in run_nodes(ast.parse(text)):
        for old, new in changed(node):
            assert isinstance(old, ast.expr)
            assert old.end_lineno
            assert old.end_col_offset
            start, end = (
                starts[old.lineno - 1] + old.col_offset,
                starts[old.end_lineno - 1] + old.end_col_offset,
            )
            name = file.relative_to(REPOSITORY).as_posix()
            found.append(
                Mutant(name, old.lineno, start, end, text[start:end].decode(), f"({ast.unparse(new)})")
            )
    return found


def draw(all_mutants: Sequence[Mutant], count: int, seed: int) -> list[Mutant]:
    """Return `count` faults that do not overlap, from each folder in proportion to those that it has."""
    chance = random.Random(seed)  # noqa: S311
    by_folder = defaultdict(list)
    for mutant in all_mutants:
        by_folder[mutant.folder].append(mutant)
    drawn: list[Mutant] = []
    wanted = 0.0
    for _, mutants in sorted(by_folder.items()):
        wanted += count * len(mutants) / len(all_mutants)
        for mutant in chance.sample(mutants, len(mutants)):
            if len(drawn) >= round(wanted):
                break
            overlaps = (
                each.file == mutant.file and each.start < mutant.end and mutant.start < each.end
                for each in drawn
            )
            if not any(overlaps):
                drawn.append(mutant)
    return drawn


def replace(folder: Path, changes: Sequence[tuple[Mutant, str]]) -> dict[Path, bytes]:
    """Replace the text of places in a copy of the tree. Return the former contents of its files."""
    former: dict[Path, bytes] = {}
    for mutant, text in sorted(changes, key=lambda change: -change[0].start):
        file = folder / mutant.file
        content = file.read_bytes()
        former.setdefault(file, content)
        file.write_bytes(content[: mutant.start] + text.encode() + content[mutant.end :])
    _delete_compiled(former)
    return former


def restore(former: dict[Path, bytes]) -> None:
    """Write back what `replace` returned."""
    for file, content in former.items():
        file.write_bytes(content)
    _delete_compiled(former)


def _delete_compiled(files: dict[Path, bytes]) -> None:
    """Delete what was compiled, which looks up to date after a change of the same size within a second."""
    for file in files:
        Path(importlib.util.cache_from_source(str(file))).unlink(missing_ok=True)


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
    return folder / ".venv" / "bin" / "python"


def passing_tests(
    folder: Path, python: Path, drawn: Sequence[Mutant], arguments: Sequence[str]
) -> list[list[str]]:
    """Return the tests that pass through each place, the fastest first, within the limits."""
    noted, outcomes = folder / ".noted", folder / ".noted" / "outcomes"
    noted.mkdir()
    packages = next(folder.glob(".venv/lib/python*/site-packages"), folder)
    for name, text in _MODULES.items():
        (packages / name).write_text(text.format(folder=str(noted)))
    former = replace(folder, [(each, _PROBE.format(number=n, text=each.old)) for n, each in enumerate(drawn)])
    try:
        run_tests(folder, python, "-p", "note_tests", f"--outcomes-to={outcomes}", *arguments)
    finally:
        restore(former)
        for name in _MODULES:
            (packages / name).unlink()
    seconds = {each.test: each.seconds for each in read_outcomes(outcomes) if each.result == "passed"}
    chosen = []
    for number in range(len(drawn)):
        file = noted / str(number)
        names = set(file.read_text().splitlines()) & seconds.keys() if file.exists() else set()
        tests: list[str] = []
        total = 0.0
        for test in sorted(names, key=lambda name: (seconds[name], name))[:TESTS_COUNT]:
            total += seconds[test]
            if tests and total > TESTS_S:
                break
            tests.append(test)
        chosen.append(tests)
    return chosen


def run_tests(folder: Path, python: Path, *arguments: str, limit_s: float | None = None) -> bool:
    """Run tests in a folder. Return whether they passed within the limit."""
    pytest = (str(python), "-m", "pytest", "-q", "--tb=no", "-p", "no:cacheprovider", *arguments)
    with (folder / "output").open("wb") as output:
        run = subprocess.Popen(
            [python, "-m", "tests.support.leave_nothing", *pytest], cwd=folder, stdin=subprocess.DEVNULL,
            stdout=output, stderr=output, start_new_session=True,
        )  # fmt: skip
        try:
            return run.wait(limit_s) == 0
        except subprocess.TimeoutExpired:
            return False
        finally:
            if run.poll() is None:
                run.terminate()
                with suppress(subprocess.TimeoutExpired):
                    run.wait(10)
                with suppress(ProcessLookupError):
                    os.killpg(run.pid, signal.SIGKILL)
                run.wait()


def judge(folder: Path, python: Path, mutant: Mutant, tests: Sequence[str]) -> bool:
    """Return whether one of these tests fails with the fault, which is undone afterwards."""
    former = replace(folder, [(mutant, mutant.new)])
    try:
        return not run_tests(folder, python, "-x", *tests, limit_s=LIMIT_S)
    finally:
        restore(former)


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options, tests = parser.parse_known_args(arguments)
    files = [file for root in ROOTS for file in sorted(root.rglob("*.py")) if "tests" not in file.parts]
    drawn = draw([mutant for file in files for mutant in mutants_of(file)], options.count, options.seed)
    processors = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(processors) as pool:
        folders = [Path(name).resolve() / str(number) for number in range(processors)]
        free: Queue[tuple[Path, Path]] = Queue()
        for pair in zip(folders, [copy_tree(folder) for folder in folders], strict=True):
            free.put(pair)
        folder, python = free.queue[0]
        chosen = passing_tests(
            folder, python, drawn, ["-n", str(3 * processors), "--dist", "worksteal", *tests]
        )

        def judged(mutant: Mutant, tests: Sequence[str]) -> str:
            if not tests:
                return "not run"
            pair = free.get()
            try:
                result = "noticed" if judge(*pair, mutant, tests) else "survived"
            finally:
                free.put(pair)
            if result == "survived":
                print(f"survived {len(tests)} tests: {mutant}", flush=True)
            return result

        results = list(pool.map(judged, drawn, chosen))
    for mutant, result in zip(drawn, results, strict=True):
        if result == "not run":
            print(f"not run: {mutant}")
    print(table([mutant.folder.partition("/")[0] for mutant in drawn], results))
    return 0


def table(folders: Sequence[str], results: Sequence[str]) -> str:
    """Return how many faults of each folder, and of all, were drawn, not run by a test, and noticed."""
    lines = ["", f"{'':24}{'drawn':>8}{'not run':>9}{'survived':>10}{'noticed':>9}{'of run':>8}"]
    for folder in (*sorted(set(folders)), "all"):
        counts = Counter(each for of, each in zip(folders, results, strict=True) if folder in (of, "all"))
        run = counts["survived"] + counts["noticed"]
        share = f"{counts['noticed'] / run:.0%}" if run else ""
        columns = f"{counts.total():8}{counts['not run']:9}{counts['survived']:10}{counts['noticed']:9}"
        lines.append(f"{folder:24}{columns}{share:>8}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
