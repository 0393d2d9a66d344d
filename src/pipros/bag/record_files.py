"""Name, split and limit the files of a recording. The name of an unfinished file ends in `.active`."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.bag.connection import Connection
from pipros.bag.opening import writer_for
from pipros.bag.record_queue import Received
from pipros.bag.writer import CHUNK_BYTES, BagWriter, MessageWriter, WholeWrites

if TYPE_CHECKING:
    from pipros.basics.printable import Say


@dataclass(frozen=True, slots=True)
class FileOptions:
    """Names, sizes and number of the files of a recording.

    Attributes:
        prefix: prefix of the file name; the date is appended.
        name: the file name, without a date.
        split: whether to begin a new file when `size_bytes` or `duration_s` is reached; otherwise the
            recording ends.
        max_splits: maximum number of files kept; 0 for no limit.
        size_bytes, duration_s: limits of one file; 0 for no limit.
        repeat_latched: whether to begin each further file with the latched messages.
    """

    prefix: str = ""
    name: str = ""
    split: bool = False
    max_splits: int = 0
    size_bytes: int = 0
    duration_s: float = 0.0
    compression: str = "none"
    chunk_bytes: int = CHUNK_BYTES
    repeat_latched: bool = False


class RecordFiles:
    """Writes received messages into a sequence of files. Not thread-safe.

    Args:
        say: called with a line of text when a file is opened or closed.
        on_open: called with the name of each new file.
        avoid_existing: whether to append a number to names that already exist.

    Attributes:
        lost: number of messages discarded to make room for the index on a full disk.
    """

    def __init__(
        self,
        options: FileOptions,
        say: Say,
        on_open: Say = lambda _: None,
        *,
        avoid_existing: bool = False,
    ) -> None:
        self._options = options
        self._avoids_existing = avoid_existing
        self._say = say
        self._on_open = on_open
        self._count = 0
        self._kept: deque[Path] = deque()
        self._file: Any = None
        self._path = Path()
        self._writer: MessageWriter | None = None
        self._connections: dict[tuple[str, int], tuple[Connection, Mapping[str, str]]] = {}
        self._latched: dict[tuple[str, str], Received] = {}
        self._started = (0, 0)
        self.lost = 0

    @property
    def path(self) -> Path:
        """Final path of the current file."""
        return self._path

    def open(self, now: tuple[int, int]) -> None:
        """Begin a file. Raise `OSError` if it cannot be created."""
        self._path = Path(self._next_name())
        active = self._active()
        self._file = active.open("w+b") if self._path.suffix == ".mcap" else WholeWrites(active, "w+")
        try:
            self._writer = writer_for(
                self._path,
                self._file,
                compression=self._options.compression,
                chunk_bytes=self._options.chunk_bytes,
            )
        except BaseException:
            self._file.close()
            raise
        self._connections.clear()
        self._started = now
        self._say(f"Recording to '{self._path}'.")
        self._on_open(str(self._path))
        if self._options.repeat_latched:
            for message in list(self._latched.values()):
                self._write(message, now)

    def close(self) -> None:
        """Complete the current file, and rename it.

        Raises:
            OSError: the file cannot be completed. It keeps all complete chunks, and the suffix `.active`.
        """
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        try:
            if isinstance(writer, BagWriter):
                self.lost += writer.finish_with_what_fits()
            else:
                writer.finish()
        finally:
            self._file.close()
        self._active().replace(self._path)
        self._kept.append(self._path)

    def flush(self) -> None:
        """Write the open chunk."""
        if self._writer is not None:
            self._writer.flush()

    def write(self, message: Received) -> bool:
        """Add a message, if necessary to a new file. Return False if the recording is complete.

        Raises:
            OSError: the disk is full. The message may be lost; later calls may succeed.
        """
        now = (message.seconds, message.nanoseconds)
        if self._writer is None:  # the disk was full when the new file was opened
            self.open(now)
        if not self.is_due(now):
            self._write(message, now)
            return True
        if not self._options.split:
            return False
        self._split(now)
        self._write(message, now)
        return True

    def is_due(self, now: tuple[int, int]) -> bool:
        """Return whether the file has reached its maximum size or duration."""
        options = self._options
        if self._writer is not None and options.size_bytes and self._writer.size >= options.size_bytes:
            return True
        lasted = now[0] - self._started[0] + (now[1] - self._started[1]) / 1e9
        return bool(options.duration_s) and lasted > options.duration_s

    def _split(self, now: tuple[int, int]) -> None:
        self._say(f"Closing '{self._path}'.")
        self.close()
        self._count += 1
        while self._options.max_splits and len(self._kept) >= self._options.max_splits:
            self._kept.popleft().unlink(missing_ok=True)
        self.open(now)

    def _write(self, message: Received, stamp: tuple[int, int]) -> None:
        known = self._connections.get((message.topic, id(message.header)))
        if known is None:
            known = self._connect(message)
        if message.header.get("latching") == "1":
            self._latched[message.topic, message.header.get("callerid", "")] = message
        self._open_writer().write(known[0], *stamp, message.data)

    def _open_writer(self) -> MessageWriter:
        if self._writer is None:
            raise ValueError("no file is open")
        return self._writer

    def _connect(self, message: Received) -> tuple[Connection, Mapping[str, str]]:
        writer = self._open_writer()
        fields = {name: value.encode() for name, value in message.header.items()}
        fields.setdefault("topic", message.topic.encode())
        for name in ("type", "md5sum", "message_definition"):
            fields.setdefault(name, b"")
        connections = writer.layout.connections.values()
        same = (each for each in connections if each.topic == message.topic and each.header == fields)
        connection = next(same, None) or writer.add_connection(message.topic, fields)
        # Keep a reference to the header, so that its `id` stays unique.
        self._connections[message.topic, id(message.header)] = known = connection, message.header
        return known

    def _next_name(self) -> str:
        options = self._options
        suffix = ".mcap" if options.name.endswith(".mcap") else ".bag"
        parts = [options.name.removesuffix(suffix)] if options.name else []
        if not options.name:
            parts = [part for part in (options.prefix, time.strftime("%Y-%m-%d-%H-%M-%S")) if part]
        if options.split:
            parts.append(str(self._count))
        name, number = "_".join(parts), 0
        while self._avoids_existing and os.path.exists(name + (f"_{number}" if number else "") + suffix):
            number += 1
        return name + (f"_{number}" if number else "") + suffix

    def _active(self) -> Path:
        return self._path.with_name(self._path.name + ".active")
