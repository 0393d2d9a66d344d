"""Convert entire arrays of numbers to and from wire format.

The memory of objects with a buffer (`bytes`, `bytearray`, `memoryview`, `array.array`, numpy arrays) is used
directly if the elements are in wire format; otherwise it is converted as a whole. Only lists, tuples and
other sequences are converted number by number.
"""

from __future__ import annotations

import struct
import sys
from itertools import islice

EMPTY_ELEMENTS = 65_536
"""Limit: values in one message, in addition to eight for each of its bytes. Beyond it, the message is
refused; the definition is refused if all of its messages would exceed the limit.
"""

# Type checkers treat this as True. Importing `typing` would double the time of the first message import.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

SIZES = {code: struct.calcsize(f"<{code}") for code in "bBhHiIqQfd?"}
CHUNK = 64 * 1024
"""Number of list elements that are converted at once.

No other thread runs during a conversion, which would take seconds for an entire map of 100 MB.
"""
_KINDS = (
    dict.fromkeys("bhilqn", "signed") | dict.fromkeys("BHILQNc", "unsigned") | dict.fromkeys("fde", "float")
)
_NUMPY_TYPES = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "Q": "<u8"}
_NUMPY_TYPES |= {"f": "<f4", "d": "<f8"}


def octets(value: Any) -> bytes | memoryview:
    """Convert the value of a `uint8[]` or `char[]` field to wire format.

    Raises:
        TypeError, ValueError, struct.error: an element is not a number from 0 to 255.
    """
    kind = value.__class__
    if kind is bytes:
        return value  # type: ignore[no-any-return]
    if kind is list or kind is tuple:
        return b"".join([bytes(value[start : start + CHUNK]) for start in range(0, len(value), CHUNK)])
    memory = _memory("B", value)
    if memory is None:
        raise TypeError(f"expected octets, got {kind.__name__}")
    return memory


def numbers(code: str, value: Any) -> bytes | memoryview:
    """Convert the value of a numeric array field to wire format.

    Args:
        code: the element type, as in the `struct` module. Booleans have the code `B`.

    Raises:
        TypeError, ValueError, OverflowError, struct.error: an element does not fit the type.
    """
    kind = value.__class__
    if kind is not list and kind is not tuple:
        memory = _memory(code, value)
        if memory is not None:
            return memory
    count = len(value)
    if count <= CHUNK:
        return struct.pack(f"<{count}{code}", *value)
    elements = iter(value)
    sizes = (min(CHUNK, count - start) for start in range(0, count, CHUNK))
    return b"".join([struct.pack(f"<{size}{code}", *islice(elements, size)) for size in sizes])


def numpy_numbers(numpy: Any, code: str, data: bytes | memoryview, offset: int, count: int) -> Any:
    """Return `count` numbers from serialized data as a numpy array that shares the data's memory.

    Raises:
        struct.error: there are too few bytes.
    """
    if count * SIZES[code] > len(data) - offset:
        raise struct.error(f"the data must contain {count} array elements, but is too short")
    return numpy.frombuffer(data, dtype=numpy.dtype(_NUMPY_TYPES[code]), count=count, offset=offset)


def _memory(code: str, value: Any) -> memoryview | None:
    """Return the elements of `value` in wire format, or None if they must be converted one by one."""
    try:
        view = memoryview(value)
    except TypeError:
        return None
    form = view.format.lstrip("@=<" if sys.byteorder == "little" else "@=>")
    fits = _KINDS.get(form) == _KINDS[code] and view.itemsize == SIZES[code]
    if fits and view.c_contiguous and (sys.byteorder == "little" or view.itemsize == 1):
        return view.cast("B") if view.nbytes else memoryview(b"")
    return _converted(code, value)


def _converted(code: str, value: Any) -> memoryview | None:
    """Convert a whole numpy array whose elements have another type.

    Return None for other objects, and if the conversion could change values (except by rounding floats).
    """
    numpy = sys.modules.get("numpy")
    if numpy is None or not isinstance(value, numpy.ndarray):
        return None
    wanted = numpy.dtype(_NUMPY_TYPES[code])
    if not numpy.can_cast(value.dtype, wanted, "same_kind" if wanted.kind == "f" else "safe"):
        return None
    return memoryview(numpy.ascontiguousarray(value, dtype=wanted)).cast("B")
