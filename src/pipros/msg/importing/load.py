"""Load message and service classes by type name. The name may come from an untrusted peer.

Importing a module runs it, so a package is imported only if it has a definition of the type, or a module that
genpy generated for the type. The result is the class that `from package.msg import Name` imports.
"""

from __future__ import annotations

import importlib
import sys
from typing import Any

from pipros.basics.errors import NotFound
from pipros.msg.base import Message
from pipros.msg.importing.hook import install, installed_library
from pipros.msg.language.type_names import is_full_type_name

install()  # in case `pipros.pth` has not installed the hook


def load_message_class(type_name: str) -> type[Message]:
    """Return the class of `package/Name` that `from package.msg import Name` imports.

    Raises:
        NotFound: the package or type does not exist. The text names the places that were searched.
        DefinitionError: the definition is invalid.
    """
    return _load("msg", type_name)  # type: ignore[no-any-return]


def load_service_class(type_name: str) -> Any:
    """Return the class of the service `package/Name`. Raises the same errors as `load_message_class`."""
    return _load("srv", type_name)


def _load(kind: str, type_name: str) -> Any:
    if not is_full_type_name(type_name):
        raise NotFound(f"a type name must have the form package/Name, got [{type_name}]")
    package, _, name = type_name.partition("/")
    module_name = f"{package}.{kind}"
    if module_name not in sys.modules:
        _check_defined(kind, type_name)
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name not in (package, module_name):
            raise
        raise _hidden(kind, type_name) from None
    found = getattr(module, name, None)
    if not isinstance(found, type) or not hasattr(found, "_md5sum"):
        raise _hidden(kind, type_name)
    return found


def _check_defined(kind: str, type_name: str) -> None:
    """Raise `NotFound` if no message package contains the type. Nothing is imported."""
    package, _, name = type_name.partition("/")
    try:
        installed_library().files.file(kind, type_name)
    except NotFound:
        if package in sys.stdlib_module_names or not _is_generated(f"{package}.{kind}._{name}"):
            raise
    if package in sys.stdlib_module_names:
        raise _hidden(kind, type_name)


def _is_generated(module: str) -> bool:
    """Return True if `package.kind._Name` is a module on the path. Does not import the module."""
    from importlib.machinery import PathFinder
    from importlib.util import find_spec

    package, kind, _ = module.split(".")
    try:
        found = find_spec(package)
        for part in (f"{package}.{kind}", module):
            if found is None or found.submodule_search_locations is None:
                return False
            found = PathFinder.find_spec(part, found.submodule_search_locations)
    except (ImportError, ValueError):
        return False
    return found is not None


def _hidden(kind: str, type_name: str) -> NotFound:
    try:
        file = installed_library().files.file(kind, type_name)
    except NotFound as error:
        return error
    return NotFound(
        f"{file} defines {type_name}, but the Python package {type_name.partition('/')[0]} hides it"
    )
