"""Limits on tables and data sets."""

from typing import NamedTuple


class DataLimits(NamedTuple):
    """Limits on tables and data sets. Get them with `limits.of(DataLimits)`, where `limits` is a `Limits`.

    Attributes:
        dataset_rows: maximum number of rows in an episode.
        table_bytes: maximum size of the messages in one table.
    """

    dataset_rows: int = 10_000_000
    table_bytes: int = 4 * 1024 * 1024 * 1024
