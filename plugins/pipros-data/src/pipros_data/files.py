"""Write tables to files, one batch at a time: Parquet, Arrow and CSV."""

from __future__ import annotations

import codecs
import io
import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pipros.basics.printable import printable_lines
from pipros.basics.replaced_file import overwritten_file
from pipros_data.extras import library

FORMATS = ("parquet", "arrow", "csv")


def write_arrow(tables: Iterable[object], path: str | os.PathLike[str], kind: str) -> list[str]:
    """Write one or more `pyarrow` tables or batches with the same columns to a file, replacing it.

    Return the names of the columns that were omitted because CSV cannot store bytes.

    Args:
        kind: one of `FORMATS`. Each table becomes a row group of a Parquet file, or a batch of an Arrow file.

    Raises:
        MissingExtra: pyarrow is not installed.
    """
    library("pyarrow", f"a file in the format {kind}")
    with overwritten_file(Path(path)) as file:
        return _write(tables, file, kind)


def print_csv(tables: Iterable[object]) -> list[str]:
    """Print `pyarrow` tables or batches as CSV. Return the names of the columns that CSV cannot store."""
    sys.stdout.flush()
    return _write(tables, _Terminal() if sys.stdout.isatty() else sys.stdout.buffer, "csv")


class _Terminal(io.RawIOBase):
    """Writes texts to a terminal, with escapes for control characters."""

    def __init__(self) -> None:
        super().__init__()
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        sys.stdout.write(printable_lines(self._decoder.decode(bytes(data))))
        return len(data)


def _write(tables: Iterable[Any], file: Any, kind: str) -> list[str]:
    left_out: list[str] = []
    writer = None
    for each in tables:
        table = each
        if kind == "csv":
            table, left_out = as_texts(each)
        if writer is None:
            writer = _writer(file, table.schema, kind)
        writer.write(table)
    if writer is not None:
        writer.close()
    return left_out


def _writer(file: object, schema: object, kind: str) -> Any:
    if kind == "parquet":
        return library("pyarrow.parquet", "Parquet").ParquetWriter(file, schema, compression="zstd")
    if kind == "arrow":
        return library("pyarrow", "Arrow").ipc.new_file(file, schema)
    return library("pyarrow.csv", "CSV").CSVWriter(file, schema)


def as_texts(table: Any) -> tuple[Any, list[str]]:
    """Return a table that CSV can store, and the names of the columns that were dropped.

    Nested columns become JSON strings. Columns that contain bytes are dropped.
    """
    pa = library("pyarrow", "CSV")
    kept, names, left_out = [], [], []
    for field, column in zip(table.schema, table.columns, strict=True):
        if _has_bytes(pa, field.type):
            left_out.append(field.name)
            continue
        if pa.types.is_nested(field.type):
            cells = column.to_pylist()
            texts = [None if cell is None else json.dumps(cell, default=_plain) for cell in cells]
            column = pa.array(texts, pa.string())
        kept.append(column)
        names.append(field.name)
    return pa.table(kept, names), left_out


def _has_bytes(pa: Any, kind: Any) -> bool:
    if pa.types.is_nested(kind):
        return any(_has_bytes(pa, kind.field(number).type) for number in range(kind.num_fields))
    return bool(pa.types.is_binary(kind) or pa.types.is_large_binary(kind))


def _plain(value: object) -> Any:
    """Convert a time to a number or string, because JSON has no type for times."""
    return value.value if hasattr(value, "value") else str(value)
