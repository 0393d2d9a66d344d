"""Reduce the number of rows in CSV files, for spreadsheets."""

from __future__ import annotations

import csv
from io import TextIOWrapper as _TextIOWrapper
from pathlib import Path

from pipros.basics.input_file import open_file as _open_file
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.replaced_file import overwritten_file as _overwritten_file

_star_names(__name__, "os roslib sys")


def make_sparse_skip(csv_file: str, skip: int) -> str:
    """Write the first row and every `skip`-th row after it to `NAME_sparse.csv`. Return the path.

    Raises:
        OSError: a file cannot be read or written.
        ValueError: `skip` is below 1, or the file is not UTF-8.
    """
    if skip < 1:
        raise ValueError(f"skip must be >= 1, got {skip}")
    return _thinned(csv_file, "_sparse", skip)


def make_sparse_length(csv_file: str, length: int) -> str:
    """Write at least `length` evenly spaced rows to `NAME_sprs_len.csv`. Return the path.

    All rows are written if the input has fewer than `2 * length - 1` rows.

    Raises:
        OSError: a file cannot be read or written.
        ValueError: `length` is below 1, or the file is not UTF-8.
    """
    if length < 1:
        raise ValueError(f"length must be >= 1, got {length}")
    with _open_file(csv_file) as file:
        lines = sum(1 for _ in file) + 1
    return _thinned(csv_file, "_sprs_len", max(lines // length, 1))


def _thinned(csv_file: str, suffix: str, step: int) -> str:
    path = Path(csv_file)
    output = path.with_name(f"{path.stem}{suffix}.csv")
    with (
        _TextIOWrapper(_open_file(path), newline="", encoding="utf-8") as source,
        _overwritten_file(output) as file,
    ):
        target = _TextIOWrapper(file, newline="", encoding="utf-8")
        writer = csv.writer(target)
        try:
            writer.writerows(row for number, row in enumerate(csv.reader(source)) if number % step == 0)
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"{csv_file} is not a CSV file in UTF-8: {error}") from None
        target.detach()  # `overwritten_file` closes the file
    return str(output)
