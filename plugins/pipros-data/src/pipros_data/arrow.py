"""Convert tables to Arrow tables. Contiguous columns without gaps are usually not copied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.msg.bulk.columns import Column, ListColumn, RecordColumn, TextColumn
from pipros_data.extras import library

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ALIGNMENT = 8
_MAX_OFFSET = (1 << 31) - 1
"""Maximum offset of Arrow's ordinary lists and strings."""


def arrow_table(columns: Mapping[str, Column], gaps: Mapping[str, NDArray[np.bool_]]) -> Any:
    """Return a `pyarrow.Table` with the columns, in which gaps are nulls.

    Fixed-size and variable arrays become lists, and messages in arrays become structs.

    Raises:
        MissingExtra: pyarrow is not installed.
    """
    pa = library("pyarrow", "a table for Arrow or Parquet")
    arrays = [_array(pa, column, gaps.get(name)) for name, column in columns.items()]
    return pa.Table.from_arrays(arrays, list(columns))


def _aligned(column: NDArray[Any]) -> NDArray[Any]:
    """Return a contiguous array at an address that suits Arrow, which would otherwise print warnings."""
    made = np.ascontiguousarray(column)
    return made if made.ctypes.data % _ALIGNMENT == 0 else made.copy()


def _array(pa: Any, column: Column, gaps: NDArray[np.bool_] | None = None) -> Any:
    if gaps is None or not gaps.any():
        return _whole(pa, column)
    if isinstance(column, np.ndarray) and column.ndim == 2:  # pyarrow 22 has no nulls in fixed-size lists
        column = ListColumn(np.arange(len(gaps) + 1) * column.shape[1], column)
    return _whole(pa, column).take(pa.array(np.arange(len(gaps)), mask=gaps))


def _whole(pa: Any, column: Column) -> Any:
    if isinstance(column, np.ndarray):
        flat = pa.array(_aligned(column).reshape(-1))
        return flat if column.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, column.shape[1])
    if isinstance(column, RecordColumn):
        names = list(column.columns)
        return pa.StructArray.from_arrays([_whole(pa, column[name]) for name in names], names)
    if isinstance(column, TextColumn):
        column = column.valid()
    is_large = int(column.offsets[-1]) > _MAX_OFFSET
    offsets = column.offsets.astype(np.int64 if is_large else np.int32)
    if isinstance(column, ListColumn):
        kind = pa.LargeListArray if is_large else pa.ListArray
        return kind.from_arrays(pa.array(offsets), _whole(pa, column.values))
    kind = "string" if isinstance(column, TextColumn) else "binary"
    text_type = getattr(pa, f"large_{kind}" if is_large else kind)()
    data = pa.py_buffer(_aligned(column.data))
    return pa.Array.from_buffers(text_type, len(column), [None, pa.py_buffer(offsets), data])
