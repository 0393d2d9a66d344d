"""Tables of messages: one row per message, one column per field."""

from __future__ import annotations

from collections.abc import Iterator, KeysView, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.html_table import html_table
from pipros.msg.bulk.columns import Column, blank, joined_columns, taken, text_of, without
from pipros_data.nearest import matches
from pipros_data.pictures import LAZY_COLUMNS, LazyColumn

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

RECEIPT = "_time"
"""The column with the times of receipt. No field has this name, because names begin with a letter."""

STAMP = "header.stamp"


class Table:
    """Columns of equal length, by name: `_time` (the time of receipt), and one column for each field.

    `table["x"]` is a column, `table[["x", "y"]]` a table with these columns, `table[3]` a row as a
    dictionary, and `table[10:20]` or `table[mask]` a table of these rows. `len` is the number of rows;
    iterating yields the names of the columns. polars, duckdb and pyarrow take a table as it is, by Arrow's
    PyCapsule interface.

    Fields of embedded messages have dotted names: `pose.position.x`. A column of numbers or times is a numpy
    array; see `pipros.msg.bulk.columns` for other columns. A numpy array with gaps is masked.

    Images also have the column `_image`, and point clouds `_points`. Their cells are decoded when they are
    accessed; iterating over the table does not include them, and a list with them selects all columns.

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

    def __getitem__(self, name: Any) -> Any:
        """Return a column, a row as a dictionary, or a table; see the class.

        Raises:
            KeyError: there is no column of this name.
            IndexError: there is no row of this number.
        """
        if isinstance(name, int | np.integer):
            if not -self.rows <= name < self.rows:
                raise IndexError(f"no row {name}; the table has {self.rows} rows")
            row = range(self.rows)[int(name)]
            return {each: self[each][row] for each in self}
        lazy = LAZY_COLUMNS.get(self.type)
        if isinstance(name, list) and all(isinstance(each, str) for each in name):
            if lazy is not None and lazy[0] in name:
                return self  # with the columns that it is decoded from
            gaps = {each: self.gaps[each] for each in name if each in self.gaps}
            return Table(self.topic, self.type, {each: self._column(each) for each in name}, gaps)
        if not isinstance(name, str):
            return self.take(name)
        if lazy is not None and name == lazy[0]:
            return LazyColumn(self.columns, lazy[1])
        column = self._column(name)
        if name not in self.gaps or not isinstance(column, np.ndarray):
            return column
        mask = self.gaps[name].reshape(-1, *[1] * (column.ndim - 1))
        return np.ma.MaskedArray(column, np.broadcast_to(mask, column.shape))  # type: ignore[no-untyped-call]

    def _column(self, name: str) -> Column:
        try:
            return self.columns[name]
        except KeyError:
            known = ", ".join(self.columns)
            raise KeyError(f"no column {name!r} in {self.topic}; the columns are {known}") from None

    def __getattr__(self, name: str) -> Any:
        """Raise `AttributeError` with the advice to use an index, or a data frame."""
        if name.startswith("_"):  # protocols such as that of pickle
            raise AttributeError(name)
        is_column = name in vars(self).get("columns", ())
        advice = f"table[{name!r}] is a column" if is_column else f"table.to_pandas().{name} may exist"
        raise AttributeError(f"a Table has no attribute {name!r}; {advice}", name=name, obj=self)

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __len__(self) -> int:
        """Return the number of rows."""
        return self.rows

    def keys(self) -> KeysView[str]:
        """Return the names of the columns."""
        return self.columns.keys()

    def values(self) -> Iterator[Any]:
        """Return an iterator over the columns."""
        return (self[name] for name in self)

    def items(self) -> Iterator[tuple[str, Any]]:
        """Return an iterator over the names and columns."""
        return ((name, self[name]) for name in self)

    def get(self, name: str, default: Any = None) -> Any:
        """Return a column, or `default` if there is none of this name."""
        return self[name] if name in self.columns else default

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns."""
        return self.rows, len(self.columns)

    def head(self, count: int = 5) -> Table:
        """Return the first rows."""
        return self.take(slice(max(count, 0)))

    def tail(self, count: int = 5) -> Table:
        """Return the last rows."""
        return self.take(slice(max(self.rows - max(count, 0), 0), None))

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Return the table as a PyCapsule of an Arrow stream. Raise `MissingExtra` without pyarrow."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def __array__(self, *_: object, **__: object) -> NDArray[Any]:
        """Raise `TypeError`: columns have different types, so a single array would lose them."""
        raise TypeError(
            "a Table is not an array: use table['column'], table.to_pandas(), "
            "pandas.DataFrame.from_arrow(table) (pandas 3), polars.DataFrame(table) or table.to_arrow()"
        )

    def __repr__(self) -> str:
        return f"<Table of {self.topic} ({self.type}): {self.rows} rows, {len(self.columns)} columns>"

    def _repr_html_(self) -> str:
        """Return the first and last rows, for notebooks."""
        count = self.rows
        ends = [*range(min(count, 5)), *range(max(count - 5, 5), count)]
        cells = [[number, *(self._shown(name, number) for name in self)] for number in ends]
        if count > 10:
            cells.insert(5, ["…", *[""] * len(self.columns)])
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
        return len(next(iter(self.columns.values()), ()))

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
        from pipros_data.arrow import arrow_table

        return arrow_table(self.columns, self.gaps)

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame`. Raise `MissingExtra` if pandas or pyarrow is not installed."""
        from pipros_data.extras import user_library

        user_library("pandas", "to_pandas")
        return self.to_arrow().to_pandas()

    def to_polars(self) -> Any:
        """Return a `polars.DataFrame`. Raise `MissingExtra` if polars or pyarrow is not installed."""
        from pipros_data.extras import user_library

        return user_library("polars", "to_polars").from_arrow(self.to_arrow())

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Write a Parquet file."""
        from pipros_data.files import write_arrow

        write_arrow([self.to_arrow()], path, "parquet")


def joined_tables(tables: Sequence[Table]) -> Table:
    """Concatenate one or more tables of a topic, which must not have gaps."""
    first = tables[0]
    if len(tables) == 1:
        return first
    columns = {name: joined_columns([each.columns[name] for each in tables]) for name in first.columns}
    return Table(first.topic, first.type, columns)
