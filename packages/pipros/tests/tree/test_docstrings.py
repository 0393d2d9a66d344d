"""The examples in docstrings print what they show, and the errors that docstrings name exist."""

import ast
import builtins
import doctest
import importlib
import re
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.environments import import_path, source_files
from tests.support.trees import nodes_of, parsed


def has_example(file: Path) -> bool:
    """Return True for a file with an example that needs no master to be running."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return any(">>> " in line and "doctest: +SKIP" not in line for line in lines)


@pytest.mark.parametrize(
    "file", list(filter(has_example, source_files())), ids=lambda file: str(import_path(file))
)
def test_examples_in_docstrings_are_true(file: Path) -> None:
    module = importlib.import_module(".".join(import_path(file).with_suffix("").parts))
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    for example in doctest.DocTestFinder(exclude_empty=True).find(module):
        runner.run(example, out=report.append)
    assert runner.tries
    assert report == []


class ModuleNames(NamedTuple):
    names: set[str]
    """The identifiers in its code."""
    imports: set[str]
    """The modules that it may import."""
    raised: list[tuple[int, str]]
    """The errors without a module in sections `Raises`, each with the line of the function or class."""


def read_names(file: Path) -> ModuleNames:
    found = ModuleNames(set(), set(), [])
    for node in nodes_of(parsed(file)):
        if isinstance(node, ast.Name):
            found.names.add(node.id)
        elif isinstance(node, ast.Attribute):
            found.names.add(node.attr)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.names.update(alias.name for alias in node.names)
            found.imports.update({node.module, *(f"{node.module}.{alias.name}" for alias in node.names)})
        elif isinstance(node, ast.Import):
            found.imports.update(alias.name for alias in node.names)
        elif isinstance(node, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            found.names.add(node.name)
            _, _, section = (ast.get_docstring(node) or "").partition("\nRaises:\n")
            for errors in re.findall(r"^    (\w[\w., ]*):", section, re.MULTILINE):
                found.raised.extend((node.lineno, name) for name in errors.split(", ") if "." not in name)
    return found


def test_the_errors_in_docstrings_exist_in_what_their_modules_import() -> None:
    files = {".".join(import_path(file).with_suffix("").parts): file for file in source_files()}
    modules = {name.removesuffix(".__init__"): read_names(file) for name, file in files.items()}
    unknown = []
    for name, module in modules.items():
        reached, names = {name}, set(dir(builtins))
        waiting = [name] if module.raised else []
        while waiting:
            current = modules[waiting.pop()]
            names |= current.names
            new = (current.imports & modules.keys()) - reached
            reached |= new
            waiting += new
        unknown += [f"{name}, line {line}: {error}" for line, error in module.raised if error not in names]
    assert unknown == []
