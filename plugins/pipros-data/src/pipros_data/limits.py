"""Limits on tables and data sets."""

from typing import NamedTuple


class DataLimits(NamedTuple):
    """Limits on tables and data sets. Get them with `limits.of(DataLimits)`, where `limits` is a `Limits`.

    Attributes:
        dataset_pixels: maximum number of pixels in a picture of a data set.
        dataset_rows: maximum number of rows in an episode.
        table_batch_bytes: approximate size of the messages in one batch of a table.
        table_bytes: maximum size of the messages in one table.
    """

    dataset_pixels: int = 64 * 1024 * 1024
    dataset_rows: int = 10_000_000
    table_batch_bytes: int = 32 * 1024 * 1024
    table_bytes: int = 4 * 1024 * 1024 * 1024
