"""Converts parameters to and from Foxglove's flat list of names and values. Performs no I/O."""

from __future__ import annotations

import base64
import binascii
import bisect
import functools
import itertools
from collections.abc import Iterable, Mapping
from typing import Any
from xmlrpc.client import Binary

from pipros.basics import names
from pipros.basics.printable import printable

_BYTES, _FLOAT, _FLOATS = "byte_array", "float64", "float64_array"


class InvalidClientParameter(ValueError):
    """A client sent a parameter whose type is unknown, or whose value does not match its type."""


def flattened(value: object, name: str = "/") -> dict[str, Any]:
    """Return the individual parameters in the value of `name`, keyed by full name."""
    return dict(names.leaves_below(name, value)) if isinstance(value, dict) or name != "/" else {}


def outermost(wanted: Iterable[str]) -> tuple[str, ...]:
    """Return the given full names, sorted, without those in the namespace of another one."""
    found: list[str] = []
    for prefix in sorted(map(names.as_namespace, wanted)):
        if not found or not prefix.startswith(found[-1]):
            found.append(prefix)
    return tuple(prefix.rstrip("/") or "/" for prefix in found)


def selected(found: Mapping[str, Any], wanted: Iterable[str]) -> dict[str, Any]:
    """Return the parameters with the given names. The value of a namespace is a dictionary, as in ROS 1.

    A namespace in another requested one is in the value of that: each parameter is processed at most twice.
    """
    ordered = sorted(found)
    distinct = dict.fromkeys(wanted)
    result = {name: found[name] for name in distinct if name in found}
    for name in outermost(distinct.keys() - result.keys()):
        tree: dict[str, Any] = {}
        prefix = names.as_namespace(name)
        for key in itertools.islice(ordered, bisect.bisect_left(ordered, prefix), None):
            if not key.startswith(prefix):
                break
            *path, last = key.removeprefix(prefix).split("/")
            functools.reduce(lambda part, step: part.setdefault(step, {}), path, tree)[last] = found[key]
        if tree:
            result[name] = tree
    return result


def to_client(name: str, value: Any) -> dict[str, Any]:
    """Convert a parameter to JSON. Bytes become base64; `type` marks bytes, floats and lists of floats."""
    if isinstance(value, Binary | bytes):
        data = value.data if isinstance(value, Binary) else value
        return {"name": name, "value": base64.b64encode(data).decode(), "type": _BYTES}
    if isinstance(value, float):
        return {"name": name, "value": value, "type": _FLOAT}
    if isinstance(value, list) and value and all(isinstance(each, float) for each in value):
        return {"name": name, "value": value, "type": _FLOATS}
    return {"name": name, "value": value}


def from_client(parameter: Mapping[str, Any]) -> Any:
    """Convert the value of a client's parameter for storage on the parameter server.

    Raises:
        InvalidClientParameter: the type that the client specifies is unknown, or the value does not have it.
    """
    name, value, kind = parameter["name"], parameter["value"], parameter.get("type")
    if kind == _BYTES:
        try:
            return Binary(base64.b64decode(value, validate=True))
        except (TypeError, ValueError, binascii.Error):
            raise InvalidClientParameter(
                f"[{printable(name)}] has the type {kind}, so its value must be base64"
            ) from None
    if kind == _FLOAT:
        return _float(name, value)
    if kind == _FLOATS:
        if not isinstance(value, list):
            raise InvalidClientParameter(
                f"[{printable(name)}] has the type {kind}, so its value must be a list"
            )
        return [_float(name, each) for each in value]
    if kind is not None:
        raise InvalidClientParameter(f"[{printable(name)}] has an unknown type {printable(repr(kind), 100)}")
    return value


def _float(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InvalidClientParameter(f"[{printable(name)}]: expected a number, got {type(value).__name__}")
    try:
        return float(value)
    except OverflowError:
        raise InvalidClientParameter(f"[{printable(name)}]: the number is too large") from None
