"""Import `<package>.cfg` and `<package>.cfg.<Name>Config` directly from `.cfg` files."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from pipros_libraries.reconfigure.cfg_file import (
    BadConfigFile,
    find,
    find_all,
    module_contents,
    parameters,
    read,
)

FindPackage = Callable[[str], Any]
_SUFFIX = "Config"


def cfg_spec(find_package: FindPackage, name: str) -> ModuleSpec | None:
    """Return the spec of `<package>.cfg` or of a module in it, or None if no `.cfg` file defines it."""
    package, _, rest = name.partition(".")
    _, _, module = rest.partition(".")
    found = find_package(package)
    if found is None:
        return None
    folder = Path(os.fspath(found))
    if not module:
        files = find_all(folder)
        return ModuleSpec(name, _PackageLoader(files), is_package=True) if files else None
    if not module.endswith(_SUFFIX) or "." in module:
        return None
    file = find(folder, module.removesuffix(_SUFFIX))
    return None if file is None else ModuleSpec(name, _ConfigLoader(file), origin=str(file))


class _PackageLoader(Loader):
    """Loader of `<package>.cfg`, whose modules are created on import."""

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = files

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002
        return None

    def exec_module(self, module: ModuleType) -> None:
        module.__path__ = []
        module.__dict__["__all__"] = sorted(file.stem + _SUFFIX for file in self._files)


class _ConfigLoader(Loader):
    """Loader of one configuration's module."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:  # noqa: ARG002
        return None

    def exec_module(self, module: ModuleType) -> None:
        try:
            contents = module_contents(read(self._file))
        except BadConfigFile as error:
            raise ImportError(str(error), name=module.__name__, path=str(self._file)) from error
        module.__dict__.update(contents, extract_params=parameters)
