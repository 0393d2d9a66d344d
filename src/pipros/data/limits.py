"""The limits of tables."""

from typing import NamedTuple


class DataLimits(NamedTuple):
    """The limits of tables: `limits.of(DataLimits)` for a `Limits`.

    Attributes:
        table_batch_bytes: the messages of a topic that are decoded at once when a table is read in batches.
        table_bytes: the messages of one table in memory.
    """

    table_batch_bytes: int = 32 * 1024 * 1024
    table_bytes: int = 4 * 1024 * 1024 * 1024
