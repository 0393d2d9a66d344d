"""The members' history: files `FOLDER/<member>/<date>_<number>.mcap`, limited in total size.

Needs the extra `mcap`.
"""

from __future__ import annotations

import math
import os
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pipros.basics.limits import Limits, process_limits
from pipros.basics.replaced_file import naming, replaced_file
from pipros.basics.windows import replace_file
from pipros_tools.bag.connection import Connection, StoredMessage
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.mcap_files import McapReader, mcap_library
from pipros_tools.bag.mcap_repair import recover
from pipros_tools.bag.options import FileOptions
from pipros_tools.bag.record_files import RecordFiles

FLEET_HISTORY_FILES = 10_000
"""Maximum number of files in a router's history, for all members together. Beyond it, the oldest file of the
member with the most files is deleted.
"""

FILE_BYTES: Final = 8 * 1024 * 1024
"""Size at which a new file is started. Larger messages are not recorded."""
SMALLEST_LIMIT_BYTES: Final = 4 * FILE_BYTES
COMPLETION_S: Final = 10.0
"""Minimum interval at which `list` completes a member's current file."""
_CHUNK_BYTES: Final = 64 * 1024
_NAME: Final = re.compile(r"[\w-]{1,100}\.mcap", re.ASCII)


def is_file_name(name: str) -> bool:
    """Return whether a name is valid for a history file; valid names contain no path separators."""
    return _NAME.fullmatch(name) is not None


@dataclass(frozen=True, slots=True)
class HistoryFile:
    """A complete file.

    `begin_ns` and `end_ns` are the times of its first and last messages on the router's clock.
    """

    name: str
    bytes: int
    messages: int
    begin_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class _Stored:
    """A history file, complete or not."""

    path: Path
    bytes: int
    modified_ns: int


class HistoryFiles:
    """Writes and reads all members' histories. Thread-safe; all methods block.

    Each file begins with the last message of every latching publisher. If the total size of the files exceeds
    its limit, the oldest file of the member with the largest history is deleted; if there are too many files,
    the oldest file of the member with the most files is deleted.
    """

    def __init__(
        self,
        folder: str | Path,
        limit_bytes: int,
        *,
        clock: Callable[[], float] = time.monotonic,
        limits: Limits | None = None,
    ) -> None:
        """Create the folder if it is missing.

        Args:
            limit_bytes: maximum total size of all files.
            clock: function that returns a monotonic time in s.

        Raises:
            ValueError: the limit is less than SMALLEST_LIMIT_BYTES.
            BagError: the extra `mcap` is not installed.
            OSError: the folder cannot be created.
        """
        if limit_bytes < SMALLEST_LIMIT_BYTES:
            raise ValueError(f"the limit must be >= {SMALLEST_LIMIT_BYTES} bytes, got {limit_bytes}")
        mcap_library()
        self._folder = Path(folder)
        self._folder.mkdir(parents=True, exist_ok=True)
        self._limit_bytes = limit_bytes
        self._limits = limits or process_limits()
        self._clock = clock
        self._completed_s: dict[str, float] = {}
        self._unchecked_bytes = FILE_BYTES
        self._spare_bytes = 2 * FILE_BYTES
        self._count = 0
        self._files: dict[str, RecordFiles] = {}
        self._open: set[str] = set()
        self._lock = threading.Lock()
        self._left = sorted(self._folder.glob("*/*.mcap.active"))
        for unfinished in self._folder.glob("*/*.mcap.active.active"):
            unfinished.unlink(missing_ok=True)  # the router was killed during `recover`

    def recover(self) -> None:
        """Complete the files left by a router that was killed before this object was created.

        Only the last messages, which the router had not yet written, are lost. Files without any message are
        deleted. A file that cannot be recovered is kept, and counts toward the limits.
        """
        left, self._left = self._left, []
        with self._lock:
            self._spare_bytes += FILE_BYTES  # `_recover` copies one file at a time
            self._remove_oldest()
        for path in left:
            with suppress(BagError, OSError):
                self._recover(path)
        with self._lock:
            self._spare_bytes -= FILE_BYTES

    def _recover(self, path: Path) -> None:
        modified_ns = path.stat().st_mtime_ns
        with replaced_file(path) as file:
            recover(path, file, lambda _: None)
        os.utime(path, ns=(modified_ns, modified_ns))
        with self._lock:
            if _described(path) is None:
                self._delete(path)
            else:
                replace_file(path, path.with_suffix(""))

    def write(self, member: str, connection: Connection, time_ns: int, data: bytes) -> None:
        """Add a message.

        Raises:
            OSError: the file cannot be written, for example because the disk is full.
        """
        with self._lock:
            self._unchecked_bytes += len(data)
            if self._unchecked_bytes >= FILE_BYTES or self._count > FLEET_HISTORY_FILES:
                self._unchecked_bytes = 0
                self._remove_oldest()
            files = self._files.get(member)
            if files is None:
                (self._folder / member).mkdir(exist_ok=True)
                name = str(self._folder / member / time.strftime("%Y-%m-%d-%H-%M-%S.mcap"))
                options = FileOptions(
                    name=name,
                    split=True,
                    size_bytes=FILE_BYTES,
                    compression="lz4",
                    chunk_bytes=_CHUNK_BYTES,
                    repeat_latched=True,
                )
                self._files[member] = files = RecordFiles(
                    options, lambda _: None, self._count_file, avoid_existing=True
                )
            self._open.add(member)
            with naming(self._folder / member):
                files.write(StoredMessage(connection, time_ns, data))

    def list(self, member: str) -> list[HistoryFile]:
        """Return the complete files of a member, oldest first.

        The current file is completed first, but at most every COMPLETION_S, because each new file repeats all
        latched messages.
        """
        with self._lock:
            now_s = self._clock()
            if member in self._open and now_s - self._completed_s.get(member, -math.inf) >= COMPLETION_S:
                self._completed_s[member] = now_s
                self._complete(member)
        found = [_described(path) for path in sorted((self._folder / member).glob("*.mcap"))]
        return sorted((each for each in found if each is not None), key=lambda each: each.begin_ns)

    def read(self, member: str, name: str) -> bytes | None:
        """Return the content of a file, or None if the name is invalid or the file cannot be read."""
        if not is_file_name(name):
            return None
        try:
            return (self._folder / member / name).read_bytes()
        except OSError:
            return None

    def forget(self, member: str) -> None:
        """Complete a member's current file, and stop repeating its latched messages in later files."""
        with self._lock:
            try:
                self._complete(member)
            finally:
                self._files.pop(member, None)
                self._completed_s.pop(member, None)

    def forget_latched(self, member: str, topics: Set[str]) -> None:
        """Stop repeating the latched messages of the given topics in later files."""
        with self._lock:
            if member in self._files:
                self._files[member].forget_latched(topics)

    def close(self) -> None:
        """Complete all current files, even if some of them fail. Raise the first one's error."""
        with self._lock, ExitStack() as stack:
            for member in sorted(self._open, reverse=True):
                stack.callback(self._complete, member)

    # -- methods that require the lock -------------------------------------------------------------

    def _complete(self, member: str) -> None:
        if member in self._open:
            self._open.discard(member)
            with naming(self._folder / member):
                self._files[member].close()

    def _count_file(self, _: str) -> None:
        self._count += 1

    def _remove_oldest(self) -> None:
        """Delete files until the limits are met."""
        found = []
        for path in self._folder.glob("*/*.mcap*"):  # a killed router leaves `.active` files
            with suppress(OSError):
                status = path.stat()
                found.append(_Stored(path, status.st_size, status.st_mtime_ns))
        found.sort(key=lambda each: each.modified_ns, reverse=True)
        kept = self._thinned(found, lambda each: each.bytes, self._limit_bytes - self._spare_bytes)
        if len(kept) > FLEET_HISTORY_FILES:
            # delete more than necessary, because listing all files is slow
            kept = self._thinned(kept, lambda _: 1, FLEET_HISTORY_FILES * 9 // 10)
        self._count = len(kept)

    def _thinned(
        self, files: Iterable[_Stored], weight: Callable[[_Stored], int], limit: int
    ) -> Sequence[_Stored]:
        """Delete files until the total weight is at most `limit`. Return the remaining files.

        Each step deletes the oldest file of the member with the greatest total. Each member's files must be
        sorted newest first; the result preserves this order.
        """
        kept: dict[Path, list[_Stored]] = {}
        totals: dict[Path, int] = {}
        for each in files:
            kept.setdefault(each.path.parent, []).append(each)
            totals[each.path.parent] = totals.get(each.path.parent, 0) + weight(each)
        surplus = sum(totals.values()) - limit
        while surplus > 0:
            folder = max(totals, key=totals.__getitem__)
            oldest = kept[folder].pop()
            totals[folder] -= weight(oldest)
            surplus -= weight(oldest)
            self._delete(oldest.path)
        return [each for group in kept.values() for each in group]

    def _delete(self, path: Path) -> None:
        """Delete a file. Delete its folder, too, if the folder is empty and the member is absent."""
        member = path.parent.name
        if member in self._open and path == self._active(member):
            self._complete(member)
            self._files[member].path.unlink(missing_ok=True)
        path.unlink(missing_ok=True)
        if member not in self._files:
            with suppress(OSError):
                path.parent.rmdir()

    def _active(self, member: str) -> Path:
        path = self._files[member].path
        return path.with_name(f"{path.name}.active")


def _described(path: Path) -> HistoryFile | None:
    try:
        with McapReader(path) as reader:
            begin_ns, end_ns = reader.range_ns
            return HistoryFile(path.name, path.stat().st_size, reader.message_count, begin_ns, end_ns)
    except (BagError, OSError):
        return None


def read_rows(rows: object) -> Iterator[HistoryFile]:
    """Yield the entries of a router's file list. Malformed entries are omitted."""
    for row in rows if isinstance(rows, list) else ():
        match row:
            case [str(name), int(size), int(messages), int(begin_ns), int(end_ns)] if is_file_name(name):
                yield HistoryFile(name, size, messages, begin_ns, end_ns)
