"""Columns of a table: numpy arrays, and columns whose cells differ in size.

A column of numbers is an array with one row per message; it has two dimensions if the field is a fixed array.
Columns of octets, strings and variable-length arrays have offsets: cell `i` contains the values from
`offsets[i]` to `offsets[i + 1]`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pipros.msg.bulk.cursors import joined_parts

if TYPE_CHECKING:
    from numpy.typing import NDArray

Offsets: TypeAlias = "NDArray[np.int64]"


class _Ragged:
    """Base class of columns with offsets. `column[i]` is a cell; slices, lists and masks give a column."""

    __slots__ = ("offsets",)

    def __init__(self, offsets: Offsets) -> None:
        self.offsets = offsets

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)} cells>"

    def __iter__(self) -> Iterator[Any]:
        return (self._cell(int(a), int(b)) for a, b in pairwise(self.offsets))

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, slice) and at.step in (None, 1):
            begin, end, _ = at.indices(len(self))
            return self._with(self.offsets[begin : max(begin, end) + 1])
        if selects_cells(at):
            return self.take(np.arange(len(self))[at])
        number = range(len(self))[at]  # raises IndexError
        return self._cell(int(self.offsets[number]), int(self.offsets[number + 1]))

    @property
    def sizes(self) -> Offsets:
        """The sizes of the cells."""
        return np.diff(self.offsets)

    def to_numpy(self) -> NDArray[Any]:
        """Return the cells as an array of objects."""
        found = np.empty(len(self), object)
        for number, cell in enumerate(self):
            found[number] = cell
        return found

    def take(self, index: NDArray[Any]) -> Any:
        raise NotImplementedError

    def _cell(self, begin: int, end: int) -> Any:
        raise NotImplementedError

    def _with(self, offsets: Offsets) -> Any:
        raise NotImplementedError


class OctetColumn(_Ragged):
    """A column of `uint8[]` or `char[]`. The cells are `bytes`; `data` contains the bytes of all cells."""

    __slots__ = ("data",)

    def __init__(self, offsets: Offsets, data: NDArray[np.uint8]) -> None:
        super().__init__(offsets)
        self.data = data

    def _cell(self, begin: int, end: int) -> Any:
        return self.data[begin:end].tobytes()

    def _with(self, offsets: Offsets) -> Any:
        return type(self)(offsets, self.data)

    def take(self, index: NDArray[Any]) -> Any:
        """Return a column of the cells with these indexes."""
        sizes = self.sizes[index]
        return type(self)(offsets_of(sizes), joined_parts(self.data, self.offsets[:-1][index], sizes))


class TextColumn(OctetColumn):
    """A column of UTF-8 strings. Invalid bytes become U+FFFD when a cell is read."""

    __slots__ = ()

    def _cell(self, begin: int, end: int) -> str:
        return self.data[begin:end].tobytes().decode("utf-8", "replace")

    def valid(self) -> TextColumn:
        """Return the column as valid UTF-8, with U+FFFD in place of invalid bytes."""
        try:
            self.data[self.offsets[0] : self.offsets[-1]].tobytes().decode()
        except UnicodeDecodeError:
            pass
        else:
            starts = self.offsets[:-1][self.sizes > 0]
            if not np.any((self.data[starts] & 0xC0) == 0x80):  # a cell that begins inside a character
                return self
        cells = [cell.encode() for cell in self]
        sizes = np.fromiter(map(len, cells), np.int64, len(cells))
        return TextColumn(offsets_of(sizes), np.frombuffer(b"".join(cells), np.uint8))


class ListColumn(_Ragged):
    """A column of arrays. Each cell is a slice of `values`: a numpy array of numbers, or a column.

    Args:
        values: the elements of all cells. May be a 2-D array with a row for each cell, such as a view of
            messages whose arrays have equal lengths; it is copied when `values` is first read.
    """

    __slots__ = ("_values",)

    def __init__(self, offsets: Offsets, values: Column) -> None:
        super().__init__(offsets)
        self._values = values

    @property
    def values(self) -> Column:
        """The elements of all cells."""
        if isinstance(self._values, np.ndarray) and self._values.ndim == 2:
            self._values = np.ascontiguousarray(self._values).reshape(-1)
        return self._values

    def to_numpy(self) -> NDArray[Any]:
        """Return an array with a row for each cell. Rows of empty cells, such as gaps, are NaN.

        Raises:
            ValueError: nonempty cells differ in size, or the elements are not numbers.
        """
        sizes, values = self.sizes, self.values
        is_full = sizes > 0
        width = int(sizes.max(initial=0))
        if not isinstance(values, np.ndarray):
            raise ValueError("cells must be arrays of numbers, got strings or messages")
        if (sizes[is_full] != width).any():
            raise ValueError(f"nonempty cells must have the same size, got {sizes[is_full].min()} to {width}")
        rows = values[self.offsets[0] : self.offsets[-1]].reshape(int(is_full.sum()), width)
        if len(rows) < len(self):
            found = np.full((len(self), width), np.nan)
            found[is_full] = rows
            rows = found
        return np.asarray(rows)

    def __array__(self, dtype: Any = None, copy: Any = None) -> NDArray[Any]:
        return np.array(self.to_numpy(), dtype) if copy else np.asarray(self.to_numpy(), dtype)

    def _cell(self, begin: int, end: int) -> Any:
        return self.values[begin:end]

    def _with(self, offsets: Offsets) -> Any:
        return ListColumn(offsets, self.values)

    def take(self, index: NDArray[Any]) -> Any:
        """Return a column of the cells with these indexes."""
        sizes, offsets = self.sizes[index], offsets_of(self.sizes[index])
        at = np.repeat(self.offsets[:-1][index] - offsets[:-1], sizes) + np.arange(offsets[-1])
        return ListColumn(offsets, taken(self.values, at))


class RecordColumn:
    """A column of messages. `column["x"]` is the column of a field; `column[i]` is a message as a dictionary.

    Attributes:
        columns: the columns of the fields, by name.
    """

    __slots__ = ("_count", "columns")

    def __init__(self, columns: Mapping[str, Column], count: int) -> None:
        self.columns = columns
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (self[number] for number in range(self._count))

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, str):
            return self.columns[at]
        if selects_cells(at):
            rows = len(np.arange(self._count)[at])
            return RecordColumn({name: each[at] for name, each in self.columns.items()}, rows)
        number = range(self._count)[at]  # raises IndexError
        return {name: each[number] for name, each in self.columns.items()}

    def take(self, index: NDArray[Any]) -> RecordColumn:
        """Return a column of the messages with these indexes."""
        return RecordColumn({name: taken(each, index) for name, each in self.columns.items()}, len(index))


def selects_cells(at: object) -> bool:
    """Return whether an index of a column selects several cells: a slice, a list, an array or a mask."""
    return isinstance(at, slice | list) or (hasattr(at, "__array__") and np.ndim(at) > 0)


Column: TypeAlias = "NDArray[Any] | TextColumn | OctetColumn | ListColumn | RecordColumn"


def taken(column: Column, index: NDArray[Any]) -> Column:
    """Return a column of the cells with these indexes."""
    if isinstance(column, np.ndarray):
        return np.asarray(column[index])
    found: Column = column.take(index)
    return found


def blank(column: Column, count: int) -> Column:
    """Return a column of the same kind with `count` cells that are zero or empty."""
    if isinstance(column, np.ndarray):
        return np.zeros((count, *column.shape[1:]), column.dtype)
    if isinstance(column, RecordColumn):
        return RecordColumn({name: blank(each, count) for name, each in column.columns.items()}, count)
    found: Column = column._with(np.zeros(count + 1, np.int64))
    return found


def without(column: Column, is_gap: NDArray[np.bool_]) -> Column:
    """Return the column with its cells emptied where `is_gap` is true.

    Columns without offsets are returned unchanged.
    """
    if isinstance(column, np.ndarray | RecordColumn) or not is_gap.any():
        return column
    kept = column.take(np.flatnonzero(~is_gap))
    found: Column = kept._with(offsets_of(np.where(is_gap, 0, column.sizes)))
    return found


def text_of(cell: Any) -> str:
    """Return a short description of a cell, on one line."""
    if isinstance(cell, bytes):
        return f"{len(cell)} bytes"
    if isinstance(cell, np.ndarray):
        how: Any = {"float_kind": "{:.6g}".format}
        return " ".join(np.array2string(cell, threshold=6, edgeitems=2, formatter=how).split())
    if isinstance(cell, _Ragged):
        more = f", … {len(cell)} cells" if len(cell) > 3 else ""
        return f"[{', '.join(map(text_of, cell[:3]))}{more}]"
    return f"{len(cell)} messages" if isinstance(cell, RecordColumn) else str(cell)


def offsets_of(sizes: NDArray[Any]) -> Offsets:
    """Return the offsets of cells that have these sizes."""
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return offsets


def joined_columns(parts: list[Column]) -> Column:
    """Concatenate one or more columns of the same kind."""
    first = parts[0]
    if len(parts) == 1:
        return first
    arrays: list[Any] = parts
    if isinstance(first, np.ndarray):
        joined: NDArray[Any] = np.concatenate(arrays)
        return joined
    if isinstance(first, RecordColumn):
        columns = {name: joined_columns([each[name] for each in arrays]) for name in first.columns}
        return RecordColumn(columns, sum(map(len, arrays)))
    offsets = offsets_of(np.concatenate([each.sizes for each in arrays]))
    bounds = [slice(int(each.offsets[0]), int(each.offsets[-1])) for each in arrays]
    if isinstance(first, ListColumn):
        return ListColumn(
            offsets, joined_columns([each.values[part] for each, part in zip(arrays, bounds, strict=True)])
        )
    found: Column = type(first)(
        offsets, np.concatenate([each.data[part] for each, part in zip(arrays, bounds, strict=True)])
    )
    return found
