"""The limits of tables."""

from typing import NamedTuple


class DataLimits(NamedTuple):
    """The limits of tables: `limits.of(DataLimits)` for a `Limits`.

    Attributes:
        dataset_pixels: a picture of a data set.
        dataset_rows: the rows of an episode.
        table_batch_bytes: the messages of a topic that are decoded at once when a table is read in batches.
        table_bytes: the messages of one table in memory.
    """

    dataset_pixels: int = 64 * 1024 * 1024
    dataset_rows: int = 10_000_000
    table_batch_bytes: int = 32 * 1024 * 1024
    table_bytes: int = 4 * 1024 * 1024 * 1024
