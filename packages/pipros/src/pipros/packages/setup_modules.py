"""Find the Python modules that packages declare in their `setup.py`, for imports without a build.

The file is parsed, not run. Only literal arguments are read, in calls such as `setup()` and
`generate_distutils_setup()`. They may also be items of a dictionary, or assigned to its keys
(`d["packages"] = […]`). A computed list of packages, such as `find_packages()`, is assumed to contain every
Python package in its folder.

Any failed import may search all packages. Therefore, this module imports little, and parses only files that
contain the imported name or `find_packages`.
"""

from __future__ import annotations

import os
from stat import S_ISREG

from pipros.basics.posix import READ

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    import ast
    from collections.abc import Iterable

_LIMIT_BYTES = 256 * 1024


class SetupModules:
    """The `setup.py` files of packages. Each file is read only once."""

    def __init__(self) -> None:
        self._texts: dict[str, bytes] = {}

    def find(self, name: str, packages: Iterable[str]) -> str | None:
        """Return the path of the module or Python package `name`, or None if no `setup.py` declares it.

        Args:
            name: the name, without dots.
            packages: the folders of the ROS packages to search, in order.
        """
        for package in packages:
            text = self._texts.get(package)
            if text is None:
                text = self._texts[package] = _read(os.path.join(package, "setup.py"))
            if text and (name.encode() in text or b"find_packages" in text):
                found = declared_module(text, package, name)
                if found is not None:
                    return found
        return None


def declared_module(text: bytes, folder: str, name: str) -> str | None:
    """Return the path of the Python module or package `name`, or None if it is undeclared or does not exist.

    Args:
        text: the contents of the `setup.py`.
        folder: the folder of the `setup.py`.
    """
    import ast
    import warnings

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about invalid escapes in strings
            groups = _arguments(ast.parse(text))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    for arguments in groups:
        folders = _literal(arguments.get("package_dir"))
        folders = folders if isinstance(folders, dict) else {}
        root = os.path.join(folder, str(folders.get("", "")))
        if "packages" in arguments:
            packages = _literal(arguments["packages"])
            path = os.path.join(folder, str(folders[name])) if name in folders else os.path.join(root, name)
            if not isinstance(packages, (list, tuple)) or name in packages:
                path = os.path.normpath(path)
                if os.path.isfile(os.path.join(path, "__init__.py")):
                    return path
        modules = _literal(arguments.get("py_modules"))
        path = os.path.normpath(os.path.join(root, f"{name}.py"))
        if isinstance(modules, (list, tuple)) and name in modules and os.path.isfile(path):
            return path
    return None


def _arguments(tree: ast.Module) -> list[dict[str, ast.expr]]:
    """Return the keyword arguments of each call, the items of each dictionary, and assignments to keys."""
    import ast

    groups: list[dict[str, ast.expr]] = []
    assigned: dict[str, ast.expr] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            groups.append({keyword.arg: keyword.value for keyword in node.keywords if keyword.arg})
        elif isinstance(node, ast.Dict):
            pairs = zip(map(_literal, node.keys), node.values, strict=True)
            groups.append({key: value for key, value in pairs if isinstance(key, str)})
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Subscript):
            key = _literal(node.targets[0].slice)
            if isinstance(key, str):
                assigned[key] = node.value
    return [*groups, assigned]


def _literal(node: ast.expr | None) -> object:
    """Return the value of a literal, or None for any other expression."""
    import ast

    try:
        return None if node is None else ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError):
        return None


def _read(file: str) -> bytes:
    """Return the contents of a file, or an empty string if it is missing, too long, or not a regular file."""
    try:
        with open(os.open(file, READ), "rb") as opened:
            status = os.fstat(opened.fileno())
            if not S_ISREG(status.st_mode) or status.st_size > _LIMIT_BYTES:
                return b""
            return opened.read(_LIMIT_BYTES)
    except OSError:
        return b""
