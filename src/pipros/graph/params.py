"""Reads and writes parameters. Missing parameters and invalid values raise `GraphError`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pipros.basics.errors import Refused
from pipros.basics.names import InvalidKey, leaves_below
from pipros.graph.errors import GraphError
from pipros.graph.system_state import is_below
from pipros.net.master_client import MasterClient


class ParameterNotSet(GraphError):
    """The parameter does not exist on the parameter server."""


def leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the individual parameters in a value at `name`. Dictionaries are namespaces.

    >>> list(leaves("/wheels", {"left": 1, "rear": {"left": 2}}))
    [('/wheels/left', 1), ('/wheels/rear/left', 2)]

    Raises:
        GraphError: a key is not a string.
    """
    try:
        yield from leaves_below(name, value)
    except InvalidKey as error:
        raise GraphError(
            f"YAML dictionaries must have string keys. Invalid dictionary is:\n{error.within}"
        ) from None


def read(master: MasterClient, name: str) -> Any:
    """Return a parameter's value, or a namespace as a dictionary. Binary values are `bytes`.

    Raises:
        ParameterNotSet: the parameter is not set.
    """
    try:
        return _plain(master.get_param(name))
    except Refused:
        raise ParameterNotSet(f"Parameter [{name}] is not set") from None


def _plain(value: Any) -> Any:
    """Convert XML-RPC's binary data and dates to plain values."""
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_plain(part) for part in value]
    from xmlrpc.client import Binary, DateTime

    if isinstance(value, DateTime):
        return str(value)
    return bytes(value.data) if isinstance(value, Binary) else value


def write(master: MasterClient, name: str, value: Any) -> list[tuple[str, Any]]:
    """Set a parameter. The values in a dictionary are set one by one, so that other keys are kept.

    Return the names and values that were set.

    Raises:
        GraphError: the server cannot store a name or value.
    """
    written = list(leaves(name, value))
    for leaf, part in written:
        try:
            master.set_param(leaf, part)
        except (TypeError, OverflowError, ValueError) as error:
            raise GraphError(f"cannot set parameter [{leaf}] to [{part}]: {error}") from None
        except Refused as error:
            raise GraphError(f"cannot set parameter [{leaf}]: {error.text}") from None
    return written


def delete(master: MasterClient, name: str) -> None:
    """Delete a parameter or a namespace. `/`, which the server does not delete, is emptied.

    Raises:
        ParameterNotSet: the parameter is not set.
    """
    try:
        if name == "/":
            master.set_param(name, {})
        else:
            master.delete_param(name)
    except Refused:
        raise ParameterNotSet(f"parameter [{name}] is not set") from None


def names_below(master: MasterClient, ns: str) -> list[str]:
    """Return the names of all parameters in a namespace, sorted."""
    return sorted(name for name in master.get_param_names() if name != ns and is_below(name, ns))
