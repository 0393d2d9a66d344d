"""Check the arguments of the Master API and the Slave API.

A check is a function that takes a parameter's value and the caller's ID, and returns the value to use, with
names resolved. Error texts match those of genuine ROS. Source: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipros.basics import names

Check = Callable[[Any, str], Any]

ANY_TYPE = "*"


class ParameterInvalid(Exception):
    """An argument is invalid. The text is sent back to the caller."""

    def __init__(self, message: str) -> None:
        super().__init__(message)


def resolved_name(param_name: str, param_value: Any, caller_id: str) -> str:
    """Resolve a legal name to a global name, relative to the caller's namespace.

    Raises:
        ParameterInvalid: the name is empty, is not a string, or contains a colon or a blank.
    """
    return names.resolve(unresolved_name(param_name, param_value, caller_id), caller_id)


def unresolved_name(param_name: str, param_value: Any, caller_id: str) -> str:
    """Check a name and return it unchanged. Raises the same errors as `resolved_name`."""
    del caller_id
    name = _text(param_name, param_value)
    if ":" in name or " " in name:
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] contains illegal chars")
    return name


def valid_name(param_name: str, resolve: bool = True) -> Check:
    """Return a check that accepts a legal name, and resolves it if `resolve` is true."""
    check = resolved_name if resolve else unresolved_name
    return lambda value, caller_id: check(param_name, value, caller_id)


def below_root(param_name: str) -> Check:
    """Return a check that accepts and resolves a topic or service name: any legal name except the root."""

    def check(value: Any, caller_id: str) -> str:
        name = resolved_name(param_name, value, caller_id)
        if value == "/":  # other names that resolve to the root are accepted, as in genuine ROS
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] cannot be the global namespace")
        return name

    return check


def empty_or_valid_name(param_name: str) -> Check:
    """Return a check that accepts any string, and resolves it as a name unless it is empty."""

    def check(value: Any, caller_id: str) -> str:
        if not isinstance(value, str):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a string")
        return names.resolve(value, caller_id) if value else ""

    return check


def global_name(param_name: str) -> Check:
    """Return a check that accepts a name with a leading slash."""

    def check(value: Any, caller_id: str) -> str:
        del caller_id
        if not names.is_global(_text(param_name, value)):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a globally referenced name")
        return str(value)

    return check


def type_name(param_name: str) -> Check:
    """Return a check that accepts `package/Type` and `*`."""

    def check(value: Any, caller_id: str) -> str:
        del caller_id
        name = _text(param_name, value)
        if name != ANY_TYPE and name.count("/") != 1:
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] is not a valid package resource name")
        return name

    return check


def api_uri(paramName: str) -> Check:  # noqa: N803  # its name in ROS
    """Return a check that accepts a node's or service's URI, without contacting it."""

    def check(value: Any, caller_id: str) -> str:
        del caller_id
        if not value or not isinstance(value, str):
            raise ParameterInvalid(f"ERROR: parameter [{paramName}] is not an XMLRPC URI")
        if not value.startswith(("http://", "rosrpc://")):
            raise ParameterInvalid(f"ERROR: parameter [{paramName}] is not an RPC URI")
        return value

    return check


def publishers(param_name: str) -> Check:
    """Return a check that accepts a list of strings: the publishers' URIs."""

    def check(value: Any, caller_id: str) -> list[str]:
        del caller_id
        if not isinstance(value, list):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a list")
        if not all(isinstance(item, str) for item in value):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a list of strings")
        return value

    return check


def non_empty(param_name: str) -> Check:
    """Return a check that accepts any truthy value."""

    def check(value: Any, caller_id: str) -> Any:
        del caller_id
        if not value:
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be specified and non-empty")
        return value

    return check


def non_empty_text(param_name: str) -> Check:
    """Return a check that accepts a string that is not empty."""

    def check(value: Any, caller_id: str) -> str:
        if not isinstance(non_empty(param_name)(value, caller_id), str):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a string")
        return str(value)

    return check


def _text(param_name: str, value: Any) -> str:
    if not value or not isinstance(value, str):
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a non-empty string")
    return value
