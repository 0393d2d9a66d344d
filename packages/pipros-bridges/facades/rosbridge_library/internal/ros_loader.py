"""Look up message and service classes by type name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg import load_message_class, load_service_class


class InvalidTypeStringException(Exception):
    """The type name does not have the form package/Name."""

    def __init__(self, typestring: object) -> None:
        super().__init__(f"a type must have the form package/Name, got {typestring!r}")


class InvalidPackageException(Exception):
    """The package of a type is not installed."""

    def __init__(self, package: str, original_exception: Exception) -> None:
        super().__init__(f"package [{package}] cannot be used: {original_exception}")
        self.package = package
        self.original_exception = original_exception


class InvalidModuleException(Exception):
    """A package has no messages or no services."""

    def __init__(self, modname: str, subname: str, original_exception: Exception) -> None:
        super().__init__(f"package [{modname}] has no {subname}: {original_exception}")
        self.package = modname
        self.module = subname
        self.original_exception = original_exception


class InvalidClassException(Exception):
    """A type cannot be loaded from its package."""

    def __init__(self, modname: str, subname: str, classname: str, original_exception: Exception) -> None:
        super().__init__(
            f"cannot load [{modname}/{classname}] from {modname}.{subname}: {original_exception}"
        )
        self.original_exception = original_exception


def get_message_class(typestring: str) -> Any:
    """Return the class of a message type.

    Raises:
        InvalidTypeStringException, InvalidPackageException, InvalidClassException: the class cannot be found.
    """
    return _load(typestring, "msg", load_message_class)


def get_service_class(typestring: str) -> Any:
    """Return the class of a service type. Raises the same errors as `get_message_class`."""
    return _load(typestring, "srv", load_service_class)


def get_message_instance(typestring: str) -> Any:
    """Return a new message."""
    return get_message_class(typestring)()


def get_service_instance(typestring: str) -> Any:
    """Return an instance of a service class."""
    return get_service_class(typestring)()


def get_service_request_instance(typestring: str) -> Any:
    """Return a new request."""
    return get_service_class(typestring)._request_class()


def get_service_response_instance(typestring: str) -> Any:
    """Return a new response."""
    return get_service_class(typestring)._response_class()


def _load(typestring: Any, subname: str, load: Callable[[str], Any]) -> Any:
    parts = [part for part in str(typestring).split("/") if part] if typestring else []
    if len(parts) not in (2, 3) or (len(parts) == 3 and parts[1] != subname):
        raise InvalidTypeStringException(typestring)
    package, name = parts[0], parts[-1]
    try:
        return load(f"{package}/{name}")
    except NotFound as error:
        if "there is no package" in str(error):
            raise InvalidPackageException(package, error) from None
        raise InvalidClassException(package, subname, name, error) from None
    except PiprosError as error:
        raise InvalidClassException(package, subname, name, error) from None
