"""Name, split and limit a recording's files. The name of an unfinished file ends in `.active`."""

from __future__ import annotations

import errno
import itertools
import os
import time
from collections import deque
from collections.abc import Set
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.replaced_file import cleared
from pipros.basics.windows import replace_file
from pipros.msg.time import NS_PER_S
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.opening import writer_for
from pipros_tools.bag.options import FileOptions
from pipros_tools.bag.sinks import MessageWriter, WholeWrites
from pipros_tools.bag.writer import BagWriter

if TYPE_CHECKING:
    from pipros.basics.printable import Say

BUFFER_BYTES = 8 * 1024
"""Size of an MCAP file's buffer, whose content is lost if the recorder is killed.

Python 3.14's default size is 128 KiB.
"""


class RecordFiles:
    """Writer that adds received messages to a sequence of files. Not thread-safe.

    Args:
        say: called with a line of text when a file is opened, or is closed to start the next one.
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
        self._connections: dict[int, tuple[Connection, Connection]] = {}
        self._latched: dict[tuple[str, str], StoredMessage] = {}
        self._started_ns = 0
        self.lost = 0

    @property
    def path(self) -> Path:
        """Final path of the current file."""
        return self._path

    def open(self, now_ns: int) -> None:
        """Start a file.

        Raises:
            OSError: the file cannot be created.
            BagError: its format needs a library that is not installed.
        """
        self._path = Path(self._next_name())
        active = cleared(self._active())
        is_mcap = self._path.suffix == ".mcap"
        self._file = active.open("x+b", BUFFER_BYTES) if is_mcap else WholeWrites(active, "x+")
        try:
            self._writer = writer_for(
                self._path,
                self._file,
                compression=self._options.compression,
                chunk_bytes=self._options.chunk_bytes,
            )
        except BaseException as error:
            self._file.close()
            if not active.stat().st_size:
                active.unlink()
            if isinstance(error, OSError) and error.filename is None:
                error.filename = os.fspath(active)
            raise
        self._connections.clear()
        self._started_ns = now_ns
        self._say(f"Recording to '{self._path}'.")
        self._on_open(str(self._path))
        if self._options.repeat_latched:
            for message in list(self._latched.values()):
                self._write(message._replace(time_ns=now_ns))

    def close(self) -> None:
        """Complete and rename the current file.

        Raises:
            FileNotFoundError: another program has moved, replaced or removed the file.
            OSError: the file cannot be completed. It keeps all complete chunks and the suffix `.active`.
        """
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        try:
            if isinstance(writer, BagWriter):
                self.lost += writer.finish_with_what_fits()
            else:
                writer.finish()
            written = os.fstat(self._file.fileno())
        finally:
            self._file.close()
        active = self._active()
        if not active.exists() or not os.path.samestat(active.stat(), written):
            raise FileNotFoundError(errno.ENOENT, f"another program has replaced or moved '{active}'")
        replace_file(active, self._path)
        self._kept.append(self._path)

    def flush(self) -> None:
        """Write the open chunk to the file."""
        if self._writer is not None:
            self._writer.flush()

    def write(self, message: StoredMessage) -> bool:
        """Add a message, starting a new file if necessary.

        Return False, without adding the message, if the recording is complete.

        Raises:
            OSError: the file cannot be written, for example because the disk is full. The message may be
                lost; later calls may succeed.
        """
        if self._writer is None:  # the disk was full when the new file was opened
            self.open(message.time_ns)
        if self.is_due(message.time_ns):
            if not self._options.split:
                return False
            self._split(message.time_ns)
        self._write(message)
        return True

    def forget_latched(self, topics: Set[str]) -> None:
        """Do not repeat latched messages from the given topics in later files."""
        self._latched = {key: message for key, message in self._latched.items() if key[0] not in topics}

    def is_due(self, now_ns: int) -> bool:
        """Return whether the current file has reached its maximum size or duration."""
        options = self._options
        if self._writer is not None and options.size_bytes and self._writer.size >= options.size_bytes:
            return True
        return bool(options.duration_s) and now_ns - self._started_ns > options.duration_s * NS_PER_S

    def _split(self, now_ns: int) -> None:
        self._say(f"Closing '{self._path}'.")
        try:
            self.close()
        finally:  # what stays of a file that could not be completed must not be overwritten
            self._count += 1
        while self._options.max_splits and len(self._kept) >= self._options.max_splits:
            self._kept.popleft().unlink(missing_ok=True)
        self.open(now_ns)

    def _write(self, message: StoredMessage) -> None:
        received, time_ns, data, _, _ = message
        known = self._connections.get(id(received)) or self._connect(received)
        if received.is_latching:
            self._latched[received.topic, received.callerid] = message
        self._open_writer().write(known[0], *divmod(time_ns, NS_PER_S), data)

    def _open_writer(self) -> MessageWriter:
        if self._writer is None:
            raise ValueError("no file is open")
        return self._writer

    def _connect(self, received: Connection) -> tuple[Connection, Connection]:
        writer = self._open_writer()
        topic, header = received.topic, received.header
        connections = writer.layout.connections.values()
        same = (each for each in connections if each.topic == topic and each.header == header)
        connection = next(same, None) or writer.add_connection(topic, header)
        # Keep a reference to the received connection, so that its `id` stays unique.
        self._connections[id(received)] = known = connection, received
        return known

    def _next_name(self) -> str:
        options = self._options
        suffix = ".mcap" if options.name.endswith(".mcap") else ".bag"
        parts = [options.name.removesuffix(suffix)] if options.name else []
        if not options.name:
            parts = [part for part in (options.prefix, time.strftime("%Y-%m-%d-%H-%M-%S")) if part]
        if options.split:
            parts.append(str(self._count))
        first = name = "_".join(parts)
        numbers = itertools.count(1)
        # a killed recorder leaves a file that ends in `.active`
        while self._avoids_existing and any(
            os.path.exists(f"{name}{suffix}{end}") for end in ("", ".active")
        ):
            name = f"{first}_{next(numbers)}"
        return f"{name}{suffix}"

    def _active(self) -> Path:
        return self._path.with_name(self._path.name + ".active")
