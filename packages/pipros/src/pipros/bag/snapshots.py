"""Keep recent messages in memory, and write them to a file (a snapshot) on request."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.bag.connection import StoredMessage
from pipros.bag.errors import BagError
from pipros.bag.options import FileOptions
from pipros.bag.record_files import RecordFiles
from pipros.bag.record_queue import RecordQueue

if TYPE_CHECKING:
    from pipros.basics.printable import Say


class Snapshots:
    """Writer that moves queued messages to files. Thread-safe.

    Args:
        options: options for the files. If `repeat_latched` is true, a file starts with the latched messages
            that are no longer in the queue. Existing files are never replaced; instead, a number is appended
            to the name.
        say: called with a line of text when a file is opened.
    """

    def __init__(self, options: FileOptions, queue: RecordQueue, say: Say) -> None:
        self._options = replace(options, split=False, size_bytes=0, duration_s=0.0, repeat_latched=False)
        self._keeps_latched = options.repeat_latched
        self._queue = queue
        self._say = say
        self._latched: dict[tuple[str, str], StoredMessage] = {}
        self._lock = threading.Lock()

    def put(self, message: StoredMessage) -> None:
        """Add a message to the queue."""
        connection = message.connection
        if self._keeps_latched and connection.is_latching:
            self._latched[connection.topic, connection.callerid] = message
        self._queue.put(message)

    def write(self, now_ns: int) -> tuple[Path, int]:
        """Write a file, and return its path and the number of messages in it.

        Raises:
            BagError: there are no messages.
            OSError: the file cannot be written. The messages are lost.
        """
        with self._lock:
            messages = self._queue.get_all(0.0)
            kept = {id(message) for message in messages}
            start_ns = messages[0].time_ns if messages else now_ns
            first = [
                message._replace(time_ns=start_ns)
                for message in list(self._latched.values())
                if id(message) not in kept
            ]
            if not messages and not first:
                raise BagError("there are no messages for a snapshot")
            files = RecordFiles(self._options, self._say, avoid_existing=True)
            files.open(start_ns)
            try:
                for message in (*first, *messages):
                    files.write(message)
            finally:
                files.close()
        return files.path, len(first) + len(messages) - files.lost
