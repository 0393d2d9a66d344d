"""Rules for all sources."""

import ast
import functools
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping

import pytest

from tests.support.environments import (
    FACADES,
    FLOORS,
    REPOSITORY,
    ROOTS,
    SOURCES,
    files_below,
    import_path,
    source,
    source_files,
)
from tests.support.message_packages import message_packages
from tests.support.trees import nodes_of, parsed
from tests.tree.test_layering import package_of

# Types say something: the word `Any` is rare in each package of pipros.


MOST = 30
"""`Any` per 1,000 lines of a package."""

HIGHER = {"safe": 80}
"""Packages with more, because they read values of any type. Lower a figure if there are fewer."""


def rates() -> dict[str, float]:
    """Return the number of `Any` per 1,000 lines, by package."""
    counts: dict[str, list[int]] = {}
    for floor, file in ((top, file) for top in FLOORS for file in files_below(source(top), "*.py")):
        package = floor if floor == "pipros_libraries" else package_of(file)
        if "share" not in file.parts:
            text = file.read_text(encoding="utf-8")
            count = counts.setdefault(package, [0, 0])
            count[0] += len(re.findall(r"\bAny\b", text))
            count[1] += text.count("\n")
    return {package: 1000 * found / max(lines, 1) for package, (found, lines) in counts.items()}


def test_any_is_rare_in_each_package() -> None:
    found = rates()
    assert {name: rate for name, rate in found.items() if rate > HIGHER.get(name, MOST)} == {}
    assert [name for name in HIGHER if name in found and found[name] <= MOST] == []


# A public class has a name of its own: who looks for `Source` finds one class.


def test_public_classes_of_the_library_have_different_names() -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for file in source_files():
        if any(file.is_relative_to(folder) for folder in SOURCES):
            for node in nodes_of(parsed(file)):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(str(import_path(file)))
    assert len(found) > 1500
    assert {name: files for name, files in found.items() if len(files) > 1} == {}


# How Python runs without threads is known to one module, whose functions the others call.


def test_only_one_module_of_the_core_knows_whether_there_are_turns() -> None:
    files = [file for part in ("src", "facades") for file in REPOSITORY.glob(f"packages/*/{part}/**/*.py")]
    found = [file.name for file in files if re.search(r"\bone_thread\.turns\b", file.read_text())]
    assert len(files) > 1000
    assert found == []


# The Python packages of the shipped messages are those that `script/generate messages` writes.


def test_the_packages_of_messages_are_made_from_their_definitions() -> None:
    written = dict(message_packages(REPOSITORY))

    assert [file for file, text in written.items() if not file.is_file() or file.read_text() != text] == []


def test_no_package_of_messages_is_left_without_definitions() -> None:
    written = {
        file.relative_to(file.parents[2] if file.parent.name in ("msg", "srv") else file.parents[1])
        for file, _ in message_packages(REPOSITORY)
    }
    found = {file.relative_to(folder) for folder in FACADES for file in files_below(folder, "*.pyi")}

    assert found - written == set()


# Text that is nested too deeply is refused like other malformed text, wherever it is parsed.


PARSERS = {"json.load", "json.loads", "literal_eval", "ast.literal_eval"}
"""They raise ValueError for malformed text, and RecursionError for deep text."""
DEEP = {"RecursionError", "RuntimeError", "Exception", "BaseException"}


def caught(block: ast.Try) -> set[str]:
    types = (each.type for each in block.handlers)
    return {ast.unparse(name) for each in types if each for name in getattr(each, "elts", [each])}


def shallow(node: ast.AST, names: frozenset[str] = frozenset()) -> Iterator[int]:
    """Yield the lines of parsers inside of a `try` that catches malformed text only."""
    if (
        isinstance(node, ast.Call)
        and ast.unparse(node.func) in PARSERS
        and "ValueError" in names
        and not names & DEEP
    ):
        yield node.lineno
    body = node.body if isinstance(node, ast.Try) else []
    for child in ast.iter_child_nodes(node):
        yield from shallow(
            child, names | caught(node) if isinstance(node, ast.Try) and child in body else names
        )


def test_whoever_catches_malformed_text_also_catches_deep_text() -> None:
    found = {
        f"{import_path(file).as_posix()}:{line}"
        for folder in ROOTS
        for file in files_below(folder, "*.py")
        if any(word in (text := file.read_text(encoding="utf-8")) for word in ("json.load", "literal_eval"))
        for line in shallow(ast.parse(text))
    }

    assert found == set(), "catch RecursionError, too"


@pytest.mark.parametrize(("text", "lines"), [
    ("try: json.loads(x)\nexcept ValueError: pass", [1]),
    ("try:\n  with a:\n    f(json.load(x))\nexcept (OSError, ValueError): pass", [3]),
    ("try: json.loads(x)\nexcept (ValueError, RecursionError): pass", []),
    ("try:\n  try: json.loads(x)\n  except ValueError: pass\nexcept RecursionError: pass", []),
    ("try: pass\nexcept ValueError: json.loads(x)", []),
])  # fmt: skip
def test_the_rule_finds_them(text: str, lines: list[int]) -> None:
    assert list(shallow(ast.parse(text))) == lines


# Facades translate names, defaults and exceptions: their functions have few branches.


MAX_BRANCHES = 6

EXCEPTIONS: Mapping[str, str] = {
    "rosbridge_library.capability.Capability.basic_type_check": "one branch per kind of mistake",
    "rosbridge_library.internal.ros_loader._load": "one exception of rosbridge per kind of mistake",
    "rosbridge_server.programs.options_from_parameters": "one branch per optional parameter",
    "rospy.service.convert_return_to_response": "one branch per kind of value that a handler may return",
}
"""Functions with more branches, each with the reason."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def functions_of(tree: ast.AST, name: str) -> Iterator[tuple[str, Function]]:
    """Yield the functions in a module, class or function, each with its full name."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | Function):
            inner = f"{name}.{node.name}"
            if isinstance(node, Function):
                yield inner, node
            yield from functions_of(node, inner)
        else:
            yield from functions_of(node, name)


def branches_of(function: ast.AST) -> int:
    """Count the branches of a function, without those of functions and classes inside it."""
    count = 0
    for node in ast.iter_child_nodes(function):
        if isinstance(node, Function | ast.ClassDef):
            continue
        match node:
            case (
                ast.If() | ast.IfExp() | ast.For() | ast.AsyncFor() | ast.While() | ast.ExceptHandler()
            ) | ast.match_case():
                count += 1
            case ast.BoolOp(values=values):
                count += len(values) - 1
            case ast.comprehension(ifs=conditions):
                count += len(conditions)
        count += branches_of(node)
    return count


@functools.cache
def facade_functions() -> Mapping[str, int]:
    """Count the branches of each function of the facades."""
    found = {}
    for file in source_files():
        root = next((folder for folder in FACADES if file.is_relative_to(folder)), None)
        if root is not None:
            parts = file.relative_to(root).with_suffix("").parts
            for name, function in functions_of(parsed(file), ".".join(parts)):
                found[name] = branches_of(function)
    return found


def test_functions_of_facades_have_few_branches() -> None:
    assert len(facade_functions()) > 1900
    wrong = {name: count for name, count in facade_functions().items() if count > MAX_BRANCHES}
    assert {name: count for name, count in wrong.items() if name not in EXCEPTIONS} == {}, (
        "move what they do into pipros"
    )


def test_exceptions_are_still_needed() -> None:
    assert [name for name in EXCEPTIONS if facade_functions().get(name, 0) <= MAX_BRANCHES] == []
