"""What launch files and Python files lack: the part of `survey.py` that runs in the built workspace.

    survey_names.py FOLDER

prints, as JSON, the mistakes of each launch file, the names of ROS that pipros lacks, modules of other
projects, and the number of files in Python 2.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
import importlib
import importlib.util
import io
import json
import os
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from pipros.launch.check import mistakes
from pipros.packages.well_known import why_not_here
from pipros.workspace.index import SHARED_PACKAGES, PackageIndex

CLIENT = ("ros-ros", "ros-ros-comm", "ros-genmsg", "ros-genpy", "ros-catkin", "ros-message-generation")
"""Sources of ROS itself. After their build, pipros's packages replace those of the same names."""

_UNDECLARED = "Missing package dependencies"
_PROGRAM = re.compile(r"cannot find (?:node \[(?P<node>[^]]+)\] in )?package \[(?P<package>[^]]+)\]")
_SHEBANG = re.compile(rb"#!.*python")
_OPTIONAL = {"ImportError", "ModuleNotFoundError", "Exception", "BaseException"}


def package_folders(source: Path) -> dict[str, Path]:
    """Return the folders of the packages below a folder, by name."""
    return {package.name: package.path for package in PackageIndex([source])}


# ---- launch files


def launch_files(source: Path) -> Iterator[Path]:
    """Yield the launch files and test files below a folder."""
    for path in sorted(source.rglob("*")):
        if (
            path.suffix in (".launch", ".test")
            and path.is_file()
            and "<launch" in path.read_text(errors="replace")
        ):
            yield path


def wrong_in(file: Path, source: Path, index: PackageIndex) -> list[str]:
    """Return why a launch file cannot be started; undeclared dependencies and warnings do not count."""
    with contextlib.redirect_stdout(io.StringIO()):
        found = mistakes(file, index, with_test_depends=True)
    wrong = []
    for text in found:
        if text.startswith((_UNDECLARED, "ROSLaunch config error")):
            continue
        program = _PROGRAM.search(text)
        wrong.append(f"no program {program['package']}/{program['node'] or '*'}" if program else text)
    return list(dict.fromkeys(" ".join(text.replace(f"{source}/", "").split()) for text in wrong))


# ---- names


def python_files(source: Path) -> Iterator[Path]:
    """Yield the Python files below a folder, and the scripts whose first line names Python."""
    for path in sorted(source.rglob("*")):
        if path.is_file() and not path.is_symlink():
            if path.suffix == ".py":
                yield path
            elif not path.suffix:
                with path.open("rb") as file:
                    if _SHEBANG.match(file.readline(200)):
                        yield path


def own_modules(source: Path) -> set[str]:
    """Return the names of the modules and ROS packages below a folder."""
    names = {path.parent.name for path in source.rglob("__init__.py")}
    names |= {path.stem for path in source.rglob("*.py")}
    return names | set(package_folders(source))


def used_names(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield each imported module with the names that the file takes from it, or an empty string.

    Imports in `try` that may fail, and attributes of names that the file also assigns, are left out.
    """
    bound: dict[str, str] = {}
    for node in _needed(tree.body):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, ""
                top = alias.name.partition(".")[0]
                bound[alias.asname or top] = alias.name if alias.asname else top
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            for alias in node.names:
                yield node.module, "" if alias.name == "*" else alias.name
    stored = {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    stored |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            name = node.value.id
            if name in bound and name not in stored and isinstance(node.ctx, ast.Load):
                yield bound[name], node.attr


def _needed(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield the import statements that must succeed, in order."""
    for node in body:
        if isinstance(node, ast.Try) and any(map(_catches_import_errors, node.handlers)):
            continue
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            yield node
        else:
            yield from _needed(ast.iter_child_nodes(node))


def _catches_import_errors(handler: ast.ExceptHandler) -> bool:
    if handler.type is None:
        return True
    return any(isinstance(node, ast.Name) and node.id in _OPTIONAL for node in ast.walk(handler.type))


def exists(module: str, name: str) -> bool:
    """Return whether a module can be imported, and has the name."""
    try:
        found = importlib.import_module(module)
        if not name or hasattr(found, name):
            return True
        return importlib.util.find_spec(f"{module}.{name}") is not None
    except (ImportError, AttributeError, ValueError):
        return False


def lacking(source: Path) -> tuple[list[str], list[str], int]:
    """Return the missing names of ROS, the missing modules of others, and the number of Python 2 files."""
    own = own_modules(source)
    declared = set(re.findall(r"<(?:\w*depend)[^>]*>\s*([\w-]+)", _manifests(source)))
    ros: set[str] = set()
    others: set[str] = set()
    python2 = 0
    for path in python_files(source):
        try:
            tree = ast.parse(path.read_bytes())
        except (SyntaxError, ValueError):
            python2 += 1
            continue
        for module, name in used_names(tree):
            top = module.partition(".")[0]
            if top in own or top in sys.stdlib_module_names or hasattr(builtins, top):
                continue
            if exists(top, ""):
                is_of_ros = (
                    top in declared or top in ("rospkg", "catkin_pkg") or (SHARED_PACKAGES / top).is_dir()
                )
                if is_of_ros and not exists(module, name):
                    ros.add(f"{module}.{name}".rstrip("."))
            elif top in declared or why_not_here(top):
                ros.add(module)
            else:
                others.add(top)
    return sorted(ros), sorted(others), python2


def _manifests(source: Path) -> str:
    return "".join(path.read_text(errors="replace") for path in source.rglob("package.xml"))


def main() -> None:
    source = Path(sys.argv[1])
    index = PackageIndex.from_environment()
    launch = {str(file.relative_to(source)): wrong_in(file, source, index) for file in launch_files(source)}
    os.environ.pop("ROS_PACKAGE_PATH", None)
    with contextlib.redirect_stdout(io.StringIO()):
        names = lacking(source)
    print(json.dumps([launch, *names]))


if __name__ == "__main__":
    main()
