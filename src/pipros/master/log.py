"""The log of a master: who registered what, who set which parameter, who was refused, who has gone.

It is written by Python's loggers `rosmaster.…` and, for what peers were refused, `pipros.rpc`, in the
words of Noetic's `master.log`. Lines that tell of each call, and of each notice, are at level DEBUG.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

LEVELS: Final = ("debug", "info", "warn", "error", "fatal")
LOGGERS: Final = ("rosmaster", "pipros.rpc")
FILE_LIMIT_BYTES: Final = 50_000_000
FILES_KEPT: Final = 4
"""The sizes of Noetic: `master.log` and four older ones, `master.log.1` the youngest."""
MESSAGE_LIMIT: Final = 2_000
PAUSE_S: Final = 0.1

_FORMAT: Final = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"


class MasterLog(logging.Handler):
    """A file that gets the log of the masters of this process, until `close`.

    A thread of its own writes what came every `PAUSE_S`: to write each line at once would take a call that
    sets a parameter half as long again.
    """

    def __init__(self, file: Path, level: str | None = None, loggers: Sequence[str] = LOGGERS) -> None:
        """Makes the file and its folder, or appends.

        Args:
            level: one of `LEVELS`, for what the master itself says; by default `info`.
            loggers: the loggers to listen to, with those below them; "" are all of the process.

        Raises:
            OSError: the folder or the file cannot be made.
        """
        super().__init__()
        file.parent.mkdir(parents=True, exist_ok=True)
        self._path = file
        self._file = file.open("a", encoding="utf-8")
        self._waiting: queue.SimpleQueue[logging.LogRecord | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="master log", daemon=True)
        self._thread.start()
        self.setFormatter(_Lines(_FORMAT))
        master = logging.getLogger("rosmaster.master")
        self._loggers = [logging.getLogger(name) for name in loggers]
        self._levels_before = [(logger, logger.level) for logger in (*self._loggers, master)]
        for logger in self._loggers:
            logger.setLevel(logging.INFO)
            logger.addHandler(self)
        if level and level.lower() in LEVELS:
            master.setLevel(level.upper())
        elif level:
            logging.getLogger("rosmaster.main").error(
                "master logger level [%s] is none of %s", level, ", ".join(LEVELS)
            )

    def emit(self, record: logging.LogRecord) -> None:
        self._waiting.put(record)

    def close(self) -> None:
        """Writes what is left to write, and closes the file. Harmless when repeated."""
        for logger in self._loggers:
            logger.removeHandler(self)
        if not self._closing.is_set():
            for logger, level in self._levels_before:
                logger.setLevel(level)
            self._closing.set()
            self._waiting.put(None)
            self._thread.join()
            self._file.close()
        super().close()

    def _write(self) -> None:
        is_open = True
        while is_open:
            batch = [self._waiting.get()]
            with contextlib.suppress(queue.Empty):
                while True:
                    batch.append(self._waiting.get_nowait())
            is_open = None not in batch
            try:
                self._append("".join(f"{self.format(record)}\n" for record in batch if record))
            except OSError:  # the disk is full, say; others go on
                continue
            finally:
                self._closing.wait(PAUSE_S)

    def _append(self, text: str) -> None:
        if self._file.tell() + len(text) > FILE_LIMIT_BYTES:
            self._put_aside()
        self._file.write(text)
        self._file.flush()

    def _put_aside(self) -> None:
        self._file.close()
        names = [self._path.name, *(f"{self._path.name}.{number}" for number in range(1, FILES_KEPT + 1))]
        for younger, older in reversed(list(pairwise(names))):
            with contextlib.suppress(FileNotFoundError):
                self._path.with_name(younger).replace(self._path.with_name(older))
        self._file = self._path.open("a", encoding="utf-8")


class _Lines(logging.Formatter):
    """One line for each message, whatever the names have in them that peers chose."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  # the name in Python
        message = record.message[:MESSAGE_LIMIT]
        record.message = message if message.isprintable() else repr(message)[1:-1]
        return super().formatMessage(record)
