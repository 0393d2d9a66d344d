"""Read messages as dictionaries that `orjson` can encode, without creating messages."""

from __future__ import annotations

import base64
import struct
from collections.abc import Callable
from functools import cache
from typing import Any, Final

from pipros.msg.base import Buffer, Message
from pipros.msg.compile.arrays import numpy_numbers
from pipros.msg.compile.compiler import reader_source
from pipros.msg.compile.run import run
from pipros.msg.errors import DeserializationError
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.time import NS_PER_S

_LONG_ARRAY: Final = 32
"""Number of elements from which reading an array with numpy is faster."""


def plain_reader(cls: type[Message]) -> Callable[[Buffer], dict[str, Any]]:
    """Compile a function that returns the fields of a serialized message of type `cls` by name.

    Embedded messages are dictionaries; times have `secs` and `nsecs`; `uint8[]` and `char[]` fields are
    base64 text; other arrays of numbers are tuples, lists or numpy arrays. Invalid UTF-8 in strings is
    replaced. The function raises `DeserializationError` if there are too few bytes.
    """
    specs = specs_from_text(cls._type, cls._full_text)
    source = reader_source(specs[cls._type], specs.__getitem__, is_plain=True)
    names = {"_base64": _base64, "_canonical": _canonical, "_plain_numbers": _plain_numbers}
    read = run(source, names, f"<plain reader of {cls._type}>")["read"]

    def values(data: Buffer) -> dict[str, Any]:
        found: dict[str, Any] = {}
        try:
            read(found, data, None)
        except struct.error as error:
            raise DeserializationError(error) from None
        return found

    return values


def _base64(octets: Buffer) -> str:
    return base64.b64encode(octets).decode("ascii")


def _canonical(time: dict[str, int]) -> None:
    """Move whole seconds from `nsecs` to `secs`."""
    secs, time["nsecs"] = divmod(time["nsecs"], NS_PER_S)
    time["secs"] += secs


def _plain_numbers(code: str, data: Any, offset: int, count: int) -> Any:
    numpy = _numpy() if count >= _LONG_ARRAY and code != "?" else None
    if numpy is None:
        return struct.unpack_from(f"<{count}{code}", data, offset)
    # float32 values are encoded with the digits of float64, as Python does.
    kind = "f8" if code == "f" else None
    found = numpy_numbers(numpy, code, data, offset, count)
    with numpy.errstate(invalid="ignore"):  # newer versions of numpy warn of signalling NaN
        return found.astype(kind or found.dtype.newbyteorder("="))


@cache
def _numpy() -> Any:
    from pipros.basics.extras import optional  # compiled messages are imported by every node

    return optional("numpy")
