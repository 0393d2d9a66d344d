"""Load message and service classes by type name. The name may come from an untrusted peer.

Importing a module runs it, so a package is imported only if it has a definition of the type, or a module that
genpy generated for the type. The result is the class that `from package.msg import Name` imports.
"""

from __future__ import annotations

import sys
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg.importing.hook import install, installed_library
from pipros.msg.importing.modules import ros1_module
from pipros.msg.language.type_names import is_full_type_name

install()  # in case `pipros.pth` has not installed the hook

_SOURCE_CHARACTERS = 10_000
"""Number of characters searched for the MD5 sum, which is in the first lines of a generated module."""


def load_message_class(type_name: str) -> type[Any]:
    """Return the class of `package/Name` that `from package.msg import Name` imports.

    Raises:
        NotFound: the package or type does not exist. The text names a place that was searched, or explains
            how to install the package.
        DefinitionError: the definition is invalid.
    """
    return _load("msg", type_name)  # type: ignore[no-any-return]


def load_service_class(type_name: str) -> Any:
    """Return the class of the service `package/Name`. Raises the same errors as `load_message_class`."""
    return _load("srv", type_name)


def installed_md5(type_name: str) -> str | None:
    """Return the MD5 sum of an installed message type, or None if it is not installed or is invalid.

    Nothing is imported, so the name may come from an untrusted peer.
    """
    from pipros.msg.language.digest import message_md5

    if not is_full_type_name(type_name):
        return None
    lookup = installed_library().definitions.message
    try:
        return message_md5(lookup(type_name), lookup)
    except NotFound:
        return _generated_md5("{}.msg._{}".format(*type_name.split("/")))
    except PiprosError:
        return None


def _load(kind: str, type_name: str) -> Any:
    if not is_full_type_name(type_name):
        raise NotFound(f"a type name must have the form package/Name, got [{type_name}]")
    package, _, name = type_name.partition("/")
    module_name = f"{package}.{kind}"
    if module_name not in sys.modules:
        _check_defined(kind, type_name)
    try:
        module = ros1_module(package, kind)
    except ModuleNotFoundError as error:
        if error.name not in (package, module_name, f"pipros.ros1.{module_name}"):
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
        if package in sys.stdlib_module_names or not _generated_file(f"{package}.{kind}._{name}"):
            raise
    if package in sys.stdlib_module_names:
        raise _hidden(kind, type_name)


def _generated_file(module: str) -> str | None:
    """Return the file of the module `package.kind._Name`; None if there is none. Nothing is imported."""
    from importlib.machinery import PathFinder
    from importlib.util import find_spec

    package, kind, _ = module.split(".")
    try:
        found = find_spec(package)
        for part in (f"{package}.{kind}", module):
            if found is None or found.submodule_search_locations is None:
                return None
            found = PathFinder.find_spec(part, found.submodule_search_locations)
    except (ImportError, KeyError, ValueError):  # KeyError: a namespace package that is not imported
        return None
    return None if found is None else found.origin


def _generated_md5(module: str) -> str | None:
    """Return the MD5 sum in the source of a class that genpy generated, or None if it cannot be read."""
    import re

    file = _generated_file(module)
    if file is None:
        return None
    try:
        with open(file, encoding="utf-8", errors="replace") as opened:
            found = re.search(
                r'^  _md5sum = "([0-9a-f]{32})"$', opened.read(_SOURCE_CHARACTERS), re.MULTILINE
            )
    except OSError:
        return None
    return found and found[1]


def _hidden(kind: str, type_name: str) -> NotFound:
    try:
        file = installed_library().files.file(kind, type_name)
    except NotFound as error:
        return error
    return NotFound(
        f"{file} defines {type_name}, but the Python package {type_name.partition('/')[0]} hides it"
    )
