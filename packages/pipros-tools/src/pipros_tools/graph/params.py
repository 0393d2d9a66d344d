"""Reads and writes parameters. Missing parameters and invalid values raise `GraphError`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from pipros.basics.errors import Refused
from pipros.basics.names import InvalidKey, canonicalize, leaves_below
from pipros.net.master_client import MasterClient
from pipros.wire.xmlrpc import PARAMETER_RULE, encode_call
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.system_state import is_below


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
        GraphError: the server cannot store a name or value. If XML-RPC has no form for it, none is set.
    """
    written = list(leaves(name, value))
    for leaf, part in written:
        try:
            encode_call("setParam", (leaf, part))
        except (TypeError, OverflowError):
            raise GraphError(f"cannot set parameter [{leaf}] to [{part}]: {PARAMETER_RULE}") from None
        except ValueError as error:
            raise GraphError(f"cannot set parameter [{leaf}] to [{part}]: {error}") from None
    for leaf, part in written:
        try:
            master.set_param(leaf, part)
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


def refused(name: str, value: Any, known: Iterable[str], allow: Callable[[str], bool]) -> str | None:
    """Return a parameter that a change affects although `allow` refuses its name, or None.

    A dictionary sets the parameters in it, and replaces those that are stored below or above its name.

    Args:
        value: the new value of `name`; None to delete it.
        known: the names of all stored parameters.
    """
    written = () if value is None else (leaf for leaf, _ in leaves_below(name, value, _joined))
    replaced = (each for each in known if is_below(each, name) or is_below(name, each))
    return next((each for each in (name, *written, *replaced) if not allow(each)), None)


def visible(name: str, value: Any, allow: Callable[[str], bool]) -> Any:
    """Return the value of a parameter without the parameters below it whose names `allow` refuses."""
    if not isinstance(value, dict):
        return value
    parts = ((key, _joined(name, key), part) for key, part in value.items())
    return {
        key: visible(below, part, allow)
        for key, below, part in parts
        if isinstance(part, dict) or allow(below)
    }


def _joined(namespace: str, key: str) -> str:
    return canonicalize(f"{namespace}/{key}")


def names_below(master: MasterClient, ns: str) -> list[str]:
    """Return the names of all parameters in a namespace, sorted."""
    return sorted(name for name in master.get_param_names() if name != ns and is_below(name, ns))
