"""Write a master's log file: registrations, parameter changes, refused peers and nodes that have ended.

The file records Python's loggers `rosmaster.…` and, for refused peers, `pipros.rpc`, with the messages of
Noetic's `master.log`. Individual calls and notices are logged at level DEBUG.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from pipros.basics import one_thread
from pipros.basics.limits import Limits
from pipros.basics.log_file import LogFile
from pipros.basics.printable import printable

LEVELS: Final = ("debug", "info", "warn", "error", "fatal")
CAPTURED: Final = ("rosmaster", "pipros.rpc")
MESSAGE_LIMIT: Final = 2_000
PAUSE_S: Final = 0.1

_FORMAT: Final = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"


class MasterLog(logging.Handler):
    """Writes the log of all masters in this process to a file until `close` is called.

    A thread writes the queued lines every `PAUSE_S`, because writing each line immediately would make
    `setParam` calls take 50% longer.
    """

    def __init__(
        self,
        file: Path,
        level: str | None = None,
        loggers: Sequence[str] = CAPTURED,
        *,
        limits: Limits | None = None,
    ) -> None:
        """Open the file, as a `LogFile` does.

        Args:
            level: one of `LEVELS`, for the master's own messages; defaults to `info`.
            loggers: the names of the loggers to record, including their children; "" records all loggers in
                the process.
            limits: `log_bytes` and `log_files` limit the size and number of this file and its predecessors
                (`x.log.1`, …); defaults to the process-wide limits.
        """
        super().__init__()
        self._file = LogFile(file, limits)
        self._pending: queue.SimpleQueue[logging.LogRecord | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="master log", daemon=True)
        if one_thread.has_threads():
            self._thread.start()
        else:
            one_thread.start_work(self._write, self._write_turn, name="master log")
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
                "master logger level must be one of %s, got [%s]", ", ".join(LEVELS), level
            )

    def emit(self, record: logging.LogRecord) -> None:
        self._pending.put(record)

    def close(self) -> None:
        """Write all pending lines and close the file. May be called repeatedly."""
        for logger in self._loggers:
            logger.removeHandler(self)
        if not self._closing.is_set():
            for logger, level in self._levels_before:
                logger.setLevel(level)
            self._closing.set()
            self._pending.put(None)
            if one_thread.has_threads():
                self._thread.join()
            else:
                self._write_turn()
            self._file.close()
        super().close()

    def _write(self) -> None:
        while self._write_batch([self._pending.get()]):
            self._closing.wait(PAUSE_S)

    def _write_turn(self) -> float | None:
        """Without a thread: write the queued lines. Return the time until the next turn; None at the end."""
        return PAUSE_S if self._write_batch([]) else None

    def _write_batch(self, batch: list[logging.LogRecord | None]) -> bool:
        """Write the batch and all queued lines. Return False once the log is closed."""
        with contextlib.suppress(queue.Empty):
            while True:
                batch.append(self._pending.get_nowait())
        self._file.write("".join(f"{self._line(record)}\n" for record in batch if record))
        return None not in batch

    def _line(self, record: logging.LogRecord) -> str:
        try:
            return self.format(record)
        except Exception as error:
            # the arguments do not fit the format; the other lines in the batch must not be lost
            return f"[{record.name}][{record.levelname}] cannot be shown: {record.msg!r:.200} ({error})"


class _Lines(logging.Formatter):
    """Formats each message as one line, even if names from peers contain line breaks."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  # logging's name
        record.message = printable(record.message, MESSAGE_LIMIT)
        return super().formatMessage(record)
