"""Messages as plain numpy arrays, for files that store nothing else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.msg.bulk.columns import Column, OctetColumn, RecordColumn, TextColumn
from pipros.msg.bulk.decode import decode
from pipros.msg.bulk.plans import plan_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WIDE = 16
"""Maximum ratio of the size of an array of texts, which all have the width of the longest, to their sum."""


def field_arrays(
    type_name: str, full_text: str, data: bytes | memoryview, ends: Sequence[int]
) -> dict[str, NDArray[Any]]:
    """Return an array for each field of joined messages, which end at the positions `ends`.

    Arrays of equal lengths become an array with a row for each message. Otherwise, all elements are joined,
    and the array `NAME:offsets` has the position of the first element of each message, and the end of the
    last. The same applies to strings that differ much in length, which are UTF-8 bytes then, and to each
    field of arrays of messages: `points.x`. Times are integers in ns.

    Raises:
        MalformedMessage: a message does not match the definition.
    """
    columns = decode(plan_of(type_name, full_text), np.frombuffer(data, np.uint8), np.array(ends, np.int64))
    return {name: array for field, column in columns.items() for name, array in _arrays(field, column)}


def _arrays(name: str, column: Column) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(column, np.ndarray):
        yield name, column
    elif isinstance(column, RecordColumn):
        for field, each in column.columns.items():
            yield from _arrays(f"{name}.{field}", each)
    elif isinstance(column, TextColumn) and _is_narrow(column):
        yield name, np.array(list(column), np.str_)
    else:
        sizes, first, last = column.sizes, int(column.offsets[0]), int(column.offsets[-1])
        values = column.data if isinstance(column, OctetColumn) else column.values
        values = values[first:last]
        if isinstance(values, np.ndarray) and values.ndim == 1 and len(set(sizes.tolist())) <= 1:
            yield (
                name,
                values.reshape(len(sizes), -1) if len(values) else np.zeros((len(sizes), 0), values.dtype),
            )
            return
        yield f"{name}:offsets", column.offsets - first
        yield from _arrays(name, values)


def _is_narrow(column: TextColumn) -> bool:
    sizes = column.sizes
    return int(sizes.max(initial=0)) * len(sizes) <= _WIDE * (int(sizes.sum()) + len(sizes) + 1000)
