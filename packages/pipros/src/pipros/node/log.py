"""A node's log handlers: for the console, a file, and the topic `/rosout`.

They are handlers for Python's `logging`, added to the node's logger. `ROSCONSOLE_FORMAT` sets the console
format; see http://wiki.ros.org/rosconsole#Console_Output_Formatting.
"""

from __future__ import annotations

import logging
import os
import re
import sys
import threading
from collections.abc import Callable, Iterable
from io import StringIO, TextIOBase
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from pipros.basics.cache_files import Untrusted, check_owner
from pipros.basics.errors import PiprosError
from pipros.basics.file_names import file_stem
from pipros.basics.input_file import read_text
from pipros.basics.log_file import LogFile, warn_unwritable
from pipros.basics.posix import HAS_OWNERS
from pipros.basics.printable import write_line
from pipros.basics.warn_once import warn_once
from pipros.msg.time import NS_PER_S
from pipros.node.clock import Clock

if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros.node.publisher import Publisher

DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"

_FILE_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
_PLACEHOLDER = r"\$\{(?P<key>\w+)(?::(?P<format>[^{}]*))?\}"
_RESET = "\033[0m"


class Severity:
    """A ROS log level: its name, its number on `/rosout`, and its colour on a terminal."""

    __slots__ = ("colour", "name", "number")

    def __init__(self, name: str, number: int, colour: str) -> None:
        self.name = name
        self.number = number
        self.colour = colour

    @staticmethod
    def of(levelno: int) -> Severity:
        """Return the ROS level for a level of Python's logging. Levels in between are rounded down."""
        return next((severity for lowest, severity in _SEVERITIES if levelno >= lowest), _DEBUG)


_DEBUG = Severity("DEBUG", 1, "\033[32m")
_SEVERITIES = (
    (logging.CRITICAL, Severity("FATAL", 16, "\033[31m")),
    (logging.ERROR, Severity("ERROR", 8, "\033[31m")),
    (logging.WARNING, Severity("WARN", 4, "\033[33m")),
    (logging.INFO, Severity("INFO", 2, "")),
    (logging.DEBUG, _DEBUG),
)


class RosLogger(logging.Logger):
    """A logger whose records name the calling method with its class, as in `Driver.move`."""

    def findCaller(self, *args: Any, **kwargs: Any) -> tuple[str, int, str, str | None]:  # noqa: N802
        """Return the file, line and function of the logging call, and the stack if requested.

        Overrides the method of `logging.Logger`, and takes the same arguments.
        """
        stack_info = args[0] if args else kwargs.get("stack_info", False)
        stacklevel = args[1] if len(args) > 1 else kwargs.get("stacklevel", 1)
        frame: FrameType = sys._getframe(1)
        while frame.f_back and frame.f_code.co_filename == _LOGGING:
            frame = frame.f_back
        for _ in range(stacklevel - 1):
            frame = frame.f_back or frame
        name = frame.f_code.co_name
        if "self" in frame.f_locals:
            name = f"{type(frame.f_locals['self']).__name__}.{name}"
        stack = super().findCaller(True, stacklevel + 1)[3] if stack_info else None
        return frame.f_code.co_filename, frame.f_lineno, name, stack


_LOGGING = logging.Logger.findCaller.__code__.co_filename


def ros_logger(name: str) -> logging.Logger:
    """Return the logger with the given name: a `RosLogger`, unless the program has set another class."""
    logger = logging.getLogger(name)
    if type(logger) is logging.Logger:
        logger.__class__ = RosLogger
    return logger


class ConsoleHandler(logging.Handler):
    """Writes DEBUG and INFO to stdout and the rest to stderr, in colour if the stream is a terminal.

    The streams are looked up for each line, so that redirecting `sys.stdout` works. A program's class that
    merely has `write` may log what is printed, so lines go to the stream that it replaced, as in Noetic.
    """

    def __init__(
        self,
        node_name: str,
        clock: Callable[[], Clock | None],
        line_format: str | None,
        *,
        is_coloured: bool = True,
        is_roscpp: bool = False,
        stdout: TextIO | None = None,
        stderr: TextIO | None = None,
    ) -> None:
        """Create a handler.

        Args:
            is_roscpp: whether to write severities and times as roscpp does: `[ INFO] [1700000000.123456789]`.
            stdout, stderr: the streams to use instead of the process's own.
        """
        super().__init__()
        self._severity_width, self._digits = (5, 9) if is_roscpp else (0, 6)
        self._given = stdout, stderr
        self._first = sys.stdout, sys.stderr
        self._is_coloured = is_coloured
        self.node_name = node_name
        self.clock = clock
        self._line_format = line_format or DEFAULT_FORMAT

    def emit(self, record: logging.LogRecord) -> None:
        severity = Severity.of(record.levelno)
        which = int(record.levelno >= logging.WARNING)
        stream: TextIO | None = (sys.stdout, sys.stderr)[which]
        stream = self._given[which] or (stream if isinstance(stream, TextIOBase) else self._first[which])
        if stream is None:  # the process has no console
            return
        line = self._render(record, severity)  # raises if the arguments of the log call are wrong
        try:
            if self._is_coloured and severity.colour and stream.isatty():
                write_line(stream, f"{severity.colour}{line}", end=f"\n{_RESET}")
            else:
                write_line(stream, line)
        except (OSError, ValueError):
            pass  # the console has been closed; the node continues without it

    def _render(self, record: logging.LogRecord, severity: Severity) -> str:
        message = full_text(record)

        def value(match: re.Match[str]) -> str:
            key, time_format = match["key"], match["format"]
            if key == "time":
                return self._time(record.created, time_format)
            if key == "walltime":
                return wall_time(record.created, time_format, self._digits)
            values = {
                "severity": severity.name.rjust(self._severity_width),
                "message": message,
                "logger": record.name,
                "thread": str(record.thread),
                "file": record.pathname,
                "line": str(record.lineno),
                "function": record.funcName,
                "node": self.node_name,
            }
            return values.get(key, match[0])

        return re.sub(_PLACEHOLDER, value, self._line_format)

    def _time(self, created: float, time_format: str | None) -> str:
        text, clock = wall_time(created, time_format, self._digits), self.clock()
        if clock is None or not clock.is_simulated:
            return text
        return f"{text}, {wall_time(clock.now_ns() / NS_PER_S, time_format, self._digits)}"


class RosoutHandler(logging.Handler):
    """Publishes each record on `/rosout` as a `rosgraph_msgs/Log`."""

    def __init__(
        self,
        publisher: Publisher[Any],
        node_name: str,
        clock: Callable[[], Clock],
        topics: Callable[[], Iterable[str]],
    ) -> None:
        super().__init__()
        from pipros.msg import load_message_class
        from pipros.msg.time import Time

        self._log_class = load_message_class("rosgraph_msgs/Log")
        self._time_class = Time
        self._publisher = publisher
        self.node_name = node_name
        self.clock = clock
        self._topics = topics
        self._busy = threading.local()  # records logged while a record is being published are not published

    def emit(self, record: logging.LogRecord) -> None:
        if getattr(self._busy, "is_set", False):
            return
        self._busy.is_set = True
        try:
            message: Any = self._log_class(
                level=Severity.of(record.levelno).number,
                name=self.node_name,
                msg=full_text(record),
                file=record.filename,
                line=record.lineno,
                function=record.funcName or "",
                topics=list(self._topics()),
            )
            seconds, nanoseconds = divmod(self.clock().now_ns(), NS_PER_S)
            message.header.stamp = self._time_class(seconds, nanoseconds)
            self._publisher.publish(message)
        except Exception:
            self.handleError(record)
        finally:
            self._busy.is_set = False


class FileHandler(logging.Handler):
    """Appends each record to a `LogFile`, which also handles a full disk."""

    def __init__(self, file: LogFile) -> None:
        super().__init__()
        self._file = file
        self.setFormatter(logging.Formatter(_FILE_FORMAT))

    def emit(self, record: logging.LogRecord) -> None:
        try:
            line = self.format(record)
        except Exception:  # the arguments of the log call are wrong
            self.handleError(record)
        else:
            self._file.write(line + "\n")

    def close(self) -> None:
        self._file.close()
        super().close()


def open_file_handler(path: Path) -> FileHandler:
    """Return a handler that appends to `path`, as a `LogFile` does."""
    return FileHandler(LogFile(path))


def find_log_config(environment: Environment) -> Path | None:
    """Return the file that replaces the default configuration of Python's logging, or None.

    This is the file named by `ROS_PYTHON_LOG_CONFIG_FILE`; otherwise `config/python_logging.conf` or `.yaml`
    in `ROS_HOME`. Such a file can run code, so a file in `ROS_HOME` is used only if no other user may write
    to it or its folder.
    """
    given = environment.python_log_config
    if given is not None and os.path.exists(given):
        return given
    if given is not None:
        warn_once(
            f"WARNING: the logging configuration [{given}] does not exist: check ROS_PYTHON_LOG_CONFIG_FILE"
        )
    folder = environment.ros_home / "config"
    for config in (folder / "python_logging.conf", folder / "python_logging.yaml"):
        if not os.path.isfile(config):
            continue
        try:
            if HAS_OWNERS:
                for path in (folder, config):
                    check_owner(path.stat(), str(path))
        except Untrusted as error:
            warn_once(f"WARNING: the logging configuration is ignored: {error}")
            return None
        return config
    return None


def configure_by_file(config: Path, log_path: Path) -> bool:
    """Configure Python's logging from a file in the `logging.config` format or in YAML.

    Return False, after a warning, if it is valid but names a log file that cannot be written.
    The environment variable `ROS_LOG_FILENAME` is set to `log_path`, so that the file can refer to it.

    Raises:
        PiprosError: the file is malformed.
    """
    import logging.config

    from pipros.safe import yaml

    os.environ["ROS_LOG_FILENAME"] = str(log_path)
    try:
        log_path.parent.mkdir(parents=True, exist_ok=True)
        if config.suffix in (".yaml", ".yml"):
            logging.config.dictConfig({"version": 1, **yaml.load(read_text(config), str(config))})
        else:
            logging.config.fileConfig(StringIO(read_text(config)), disable_existing_loggers=False)
    except Exception as error:
        for cause in (error, error.__cause__):  # dictConfig wraps it
            if isinstance(cause, OSError) and cause.filename not in (None, str(config)):
                warn_unwritable(cause.filename, cause)
                return False
        raise PiprosError(f"the logging configuration [{config}] cannot be used: {error}") from error
    return True


def log_file(log_dir: Path, node_name: str, given: str | None) -> Path:
    """Return a node's log file: the file given by `__log:=`, otherwise a file named after the node."""
    if given:
        return Path(given)
    return log_dir / f"{file_stem(node_name.strip('/').replace('/', '_'))}.log"


def full_text(record: logging.LogRecord) -> str:
    """Return a record's message, followed by its traceback if it has one."""
    text = record.getMessage()
    if record.exc_info and record.exc_info[0]:
        text += "\n" + logging.Formatter().formatException(record.exc_info)
    return text


def wall_time(seconds: float, time_format: str | None, digits: int = 6) -> str:
    if time_format is None:
        return f"{seconds:.{digits}f}"
    from datetime import datetime, timezone  # time.strftime has no %f

    return datetime.fromtimestamp(seconds, timezone.utc).astimezone().strftime(time_format)


def logger_levels() -> list[tuple[str, str]]:
    """Return the name and the ROS level name of each logger except the root, as `~get_loggers` does."""
    known = logging.Logger.manager.loggerDict
    loggers = [logger for logger in known.values() if isinstance(logger, logging.Logger)]
    return [(logger.name, Severity.of(logger.getEffectiveLevel()).name) for logger in loggers]


def logger_count() -> int:
    """Return the number of loggers in the process, including placeholders for their parents."""
    return len(logging.Logger.manager.loggerDict)


def logger_exists(name: str) -> bool:
    """Return whether the process has a logger with this name. The root logger always exists."""
    return not name or isinstance(logging.Logger.manager.loggerDict.get(name), logging.Logger)


def set_logger_level(name: str, level: str) -> None:
    """Set a logger's level, as `~set_logger_level` does. An unknown level is ignored, as in genuine nodes."""
    for lowest, severity in _SEVERITIES:
        if severity.name == level.upper():
            logging.getLogger(name).setLevel(lowest)
