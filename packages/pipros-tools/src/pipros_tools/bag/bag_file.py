"""A bag open for reading, writing or appending. As with `rosbag.Bag`, it can be read while being written."""

from __future__ import annotations

from typing import Any

from pipros.basics.limits import process_limits
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.layout import BagLayout, read_layout, read_version
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.records import Version
from pipros_tools.bag.repair import reindex
from pipros_tools.bag.source import Source
from pipros_tools.bag.topic_writer import TopicWriter
from pipros_tools.bag.writer import BagWriter


class BagFile:
    """A bag in an open file, which the caller must close. Not thread-safe.

    Args:
        file: a seekable binary file, readable, and writable unless `mode` is `r`.
        name: the file's name, for error messages.
        mode: `r`, `w` or `a`.
        compression, chunk_bytes: compression and size of new chunks.
        allow_unindexed: whether to open a bag without a readable index as an empty bag, for `reindex`.

    Raises:
        BagError: the file is not a bag, or cannot be appended to.
        NotIndexed: the bag has no readable index.

    Attributes:
        version: format version as an integer: 200 for 2.0.
        writer: the bag's writer; None if the bag is read-only, or has no index until `reindex` is called.
        topics: writer that adds messages by topic name; None if `writer` is None.
    """

    def __init__(
        self,
        file: Any,
        name: str,
        mode: str,
        *,
        compression: str,
        chunk_bytes: int,
        allow_unindexed: bool = False,
    ) -> None:
        self._file, self._name, self._mode = file, name, mode
        self._compression, self._chunk_bytes = compression, chunk_bytes
        self._limits = process_limits()
        self._reader: BagReader | None = None
        self.writer: BagWriter | None = None
        self.topics: TopicWriter | None = None
        self.version = 200
        if mode == "w":
            self._write_with(BagWriter(file))
        else:
            self._open(allow_unindexed)

    def _open(self, allow_unindexed: bool) -> None:
        source = Source(self._file, self._name)
        if not source.size:
            raise BagError("empty file")
        try:
            version, start = read_version(source)
        except BagError:
            raise BagError("This does not appear to be a bag file") from None
        self.version = version.number
        if version.number != 200:
            if self._mode == "a":
                raise BagError("Only bag files of version 2.0 can be appended to")
            self._reader = BagReader(self._file, limits=self._limits)
            return
        try:
            layout = read_layout(source, start)
        except BagError:
            if not allow_unindexed:
                raise
            layout = BagLayout(Version(2, 0))
        if self._mode == "a" and layout.index_position:
            self._write_with(BagWriter(self._file, layout=layout))
        else:
            self._reader = BagReader(self._file, name=self._name, layout=layout, limits=self._limits)

    def _write_with(self, writer: BagWriter) -> None:
        writer.compression, writer.chunk_bytes = self._compression, self._chunk_bytes
        self.writer = writer
        self.topics = TopicWriter(writer)
        self._reader = None

    def set_chunks(self, compression: str, chunk_bytes: int) -> None:
        """Write the open chunk, and set the compression and size of later chunks."""
        self.flush()
        self._compression, self._chunk_bytes = compression, chunk_bytes
        if self.writer is not None:
            self.writer.compression, self.writer.chunk_bytes = compression, chunk_bytes

    @property
    def size(self) -> int:
        """The size of the file in bytes, including bytes not yet written."""
        return self.writer.size if self.writer is not None else self.view().size

    def flush(self) -> None:
        """Write the open chunk and flush the file, unless the bag is read-only."""
        if self.writer is not None:
            self.writer.flush()

    def view(self) -> BagReader:
        """Flush, and return a reader for all messages added so far."""
        if self._reader is not None:
            return self._reader
        if self.writer is None:
            raise ValueError("the bag is closed")
        self.flush()
        return BagReader(self._file, name=self._name, layout=self.writer.layout, limits=self._limits)

    def reindex(self) -> list[int]:
        """Rebuild the index, in mode `r` only in memory. Return the positions of the chunks.

        Raises:
            BagError: the bag is not in format 2.0.
        """
        if self._mode == "r":
            self._reader = BagReader(self._file, name=self._name, rebuild_index=True, limits=self._limits)
            return [chunk.position for chunk in self._reader.layout.chunks]
        self.finish()
        writer = reindex(self._file, self._name)
        self._write_with(writer)
        return [chunk.position for chunk in writer.layout.chunks]

    def finish(self) -> None:
        """Write the index, unless the bag is read-only."""
        if self.writer is not None:
            self.writer.finish()
