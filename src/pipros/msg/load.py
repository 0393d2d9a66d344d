"""Message and service classes by their type names."""

from __future__ import annotations

import importlib
from typing import Any

import pipros.startup  # noqa: F401 # the import hook, where pipros.pth did not run
from pipros.errors import NotFound
from pipros.msg.base import Message
from pipros.msg.parse import is_full_type_name


def load_message_class(type_name: str) -> type[Message]:
    """The class of `package/Name`: the one that `from package.msg import Name` gives.

    Raises:
        NotFound: no such package or type, saying where it was looked for.
        DefinitionError: the definition breaks the rules.
    """
    return _load("msg", type_name)  # type: ignore[no-any-return]


def load_service_class(type_name: str) -> Any:
    """The class of the service `package/Name`; errors as for `load_message_class`."""
    return _load("srv", type_name)


def _load(kind: str, type_name: str) -> Any:
    if not is_full_type_name(type_name):
        raise NotFound(f"[{type_name}] is not a type name of the form package/Name")
    package, _, name = type_name.partition("/")
    module_name = f"{package}.{kind}"
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name not in (package, module_name):
            raise
        raise _not_found(kind, type_name) from None
    try:
        return getattr(module, name)
    except AttributeError:
        raise _not_found(kind, type_name) from None


def _not_found(kind: str, type_name: str) -> NotFound:
    from pipros.msg.hook import installed_library

    try:
        file = installed_library().files.file(kind, type_name)
    except NotFound as error:
        return error
    return NotFound(
        f"{file} defines {type_name}, but the Python package {type_name.partition('/')[0]} hides it"
    )
