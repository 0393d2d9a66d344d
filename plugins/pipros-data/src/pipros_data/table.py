"""Tables of messages: one row per message, one column per field."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.html_table import html_table
from pipros.data.nearest import matches
from pipros.data.pictures import LAZY_COLUMNS, LazyColumn
from pipros.msg.bulk.columns import Column, blank, joined_columns, taken, text_of, without

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

RECEIPT = "_time"
"""The column with the times of receipt. No field has this name, because names begin with a letter."""

STAMP = "header.stamp"


class Table(Mapping[str, Any]):
    """Columns of equal length, by name: `_time` (the time of receipt), and one column for each field.

    Fields of embedded messages have dotted names: `pose.position.x`. A column of numbers or times is a numpy
    array; see `pipros.msg.bulk.columns` for other columns. A numpy array with gaps is masked.

    Images also have the column `_image`, and point clouds `_points`. Their cells are decoded when they are
    accessed; iterating over the table does not include them.

    Attributes:
        topic: the topic.
        type: the message type.
        columns: all columns, without masks.
        gaps: for each column with gaps, a boolean array that is True in the gaps.
    """

    def __init__(
        self,
        topic: str,
        type_name: str,
        columns: Mapping[str, Column],
        gaps: Mapping[str, NDArray[np.bool_]] | None = None,
    ) -> None:
        self.topic = topic
        self.type = type_name
        self.columns = dict(columns)
        self.gaps = dict(gaps or {})

    def __getitem__(self, name: str) -> Any:
        lazy = LAZY_COLUMNS.get(self.type)
        if lazy is not None and name == lazy[0]:
            return LazyColumn(self.columns, lazy[1])
        column = self.columns[name]
        if name not in self.gaps or not isinstance(column, np.ndarray):
            return column
        mask = self.gaps[name].reshape(-1, *[1] * (column.ndim - 1))
        return np.ma.MaskedArray(column, np.broadcast_to(mask, column.shape))  # type: ignore[no-untyped-call]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        """Return the number of columns; `rows` is the number of rows."""
        return len(self.columns)

    def __repr__(self) -> str:
        return f"<Table of {self.topic} ({self.type}): {self.rows} rows, {len(self)} columns>"

    def _repr_html_(self) -> str:
        """Return the first and last rows, for notebooks."""
        count = self.rows
        ends = [*range(min(count, 5)), *range(max(count - 5, 5), count)]
        cells = [[number, *(self._shown(name, number) for name in self)] for number in ends]
        if count > 10:
            cells.insert(5, ["…", *[""] * len(self)])
        lazy = LAZY_COLUMNS.get(self.type)
        hint = f"; {lazy[0]} decodes a cell" if lazy else ""
        return html_table(("", *self), cells, f"{self.topic} ({self.type}): {count} rows{hint}")

    def _shown(self, name: str, row: int) -> object:
        if name in self.gaps and self.gaps[name][row]:
            return "--"
        return text_of(self.columns[name][row]).replace(" ", "\N{NO-BREAK SPACE}")

    @property
    def rows(self) -> int:
        """The number of rows."""
        return len(self.columns[RECEIPT])

    def times(self, on: str = "receipt") -> NDArray[np.int64]:
        """Return the times of all rows in ns.

        Args:
            on: `receipt` for the times of receipt, or `header` for the stamps of the headers.

        Raises:
            ValueError: the messages have no header, or `on` is unknown.
        """
        if on not in ("receipt", "header"):
            raise ValueError(f"on must be receipt or header, got {on!r}")
        found = self.columns.get(RECEIPT if on == "receipt" else STAMP)
        if not isinstance(found, np.ndarray):
            raise ValueError(f"{self.topic}: {self.type} has no header; use on='receipt'")
        return found.view(np.int64)

    def take(self, index: NDArray[Any] | slice | Sequence[int]) -> Table:
        """Return a table of the rows that `index` selects: indices, a slice or a boolean array."""
        rows = np.arange(self.rows)[index]
        columns = {name: taken(column, rows) for name, column in self.columns.items()}
        return Table(self.topic, self.type, columns, {name: gaps[rows] for name, gaps in self.gaps.items()})

    def with_columns(
        self, columns: Mapping[str, Column], gaps: Mapping[str, NDArray[np.bool_]] | None = None
    ) -> Table:
        """Return a table with additional columns.

        Raises:
            ValueError: a column already exists, or has a different number of rows.
        """
        for name, column in columns.items():
            if name in self.columns or len(column) != self.rows:
                raise ValueError(
                    f"the column {name} must be new and have {self.rows} rows, got {len(column)} rows"
                )
        return Table(self.topic, self.type, {**self.columns, **columns}, {**self.gaps, **(gaps or {})})

    def asof(
        self,
        other: Table,
        *,
        on: str = "receipt",
        tolerance: float | None = None,
        direction: str = "backward",
        prefix: str | None = None,
    ) -> Table:
        """Return the table with the columns of another topic. Each row is matched to a message on that topic.

        Args:
            on: the times to compare: `receipt`, or `header` for the stamps of the headers.
            tolerance: maximum difference between the times in seconds, inclusive. Rows without a message
                within this time are gaps.
            direction: `backward` for the last message that is not later, `forward` for the first message that
                is not earlier, or `nearest` (the earlier of two equally near messages).
            prefix: added to the names of the columns; by default, the topic without its leading slash, and a
                dot: `odom.`.

        Raises:
            ValueError: an argument is invalid, or messages have no header.
        """
        index, is_gap = matches(self.times(on), other.times(on), tolerance, direction)
        prefix = f"{other.topic.lstrip('/')}." if prefix is None else prefix
        columns, gaps = {}, {}
        for name, column in other.columns.items():
            is_empty = is_gap
            if other.rows:
                is_empty = is_gap | other.gaps[name][index] if name in other.gaps else is_gap
                columns[f"{prefix}{name}"] = without(taken(column, index), is_empty)
            else:
                columns[f"{prefix}{name}"] = blank(column, self.rows)
            gaps[f"{prefix}{name}"] = is_empty
        return self.with_columns(columns, gaps)

    def to_arrow(self) -> Any:
        """Return a `pyarrow.Table`. Gaps become nulls."""
        from pipros.data.arrow import arrow_table

        return arrow_table(self.columns, self.gaps)

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`. Raise `MissingExtra` if pandas or pyarrow is not installed."""
        from pipros.data.extras import user_library

        user_library("pandas", "to_pandas")
        return self.to_arrow().to_pandas()

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write a Parquet file."""
        from pipros.data.files import write_arrow

        write_arrow([self.to_arrow()], path, "parquet")


def joined_tables(tables: Sequence[Table]) -> Table:
    """Concatenate one or more tables of a topic, which must not have gaps."""
    first = tables[0]
    if len(tables) == 1:
        return first
    columns = {name: joined_columns([each.columns[name] for each in tables]) for name in first.columns}
    return Table(first.topic, first.type, columns)
