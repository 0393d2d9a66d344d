"""A decorator that gives every command usable standard streams and reliable handling of Ctrl-C."""

from __future__ import annotations

import atexit
import codecs
import contextlib
import errno
import gc
import io
import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec

from pipros.basics import interrupts
from pipros.basics.errors import MissingExtra
from pipros.basics.printable import for_terminal, listed
from pipros.basics.windows import ON_WINDOWS

OUTPUT_FAILED = 120
"""The exit code of Python, and thus of Noetic's commands, if standard output cannot be written to."""

INTERRUPTED = 130
"""The exit code that shells report for a command that SIGINT ended."""

DISK_FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
"""Errors of files that could be written if there were more space."""

_Arguments = ParamSpec("_Arguments")

_replaced_streams: list[Any] = []
"""Standard outputs of commands that have ended. Without a reference, a stream would be freed, which would
crash a thread that is printing to it, because Python 3.11's `print` holds no reference.
"""


class OutputFailed(OSError):
    """Standard output cannot be written to, for example because its disk is full."""


def program(location: str) -> Callable[..., int]:
    """Return the command `module:function`. A library that the module lacks is reported as by `command`."""
    module, _, name = location.partition(":")

    def main(*arguments: Any) -> int:
        from importlib import import_module

        return int(getattr(import_module(module), name)(*arguments))

    return command(main)


def command(main: Callable[_Arguments, int]) -> Callable[_Arguments, int]:
    """Make `main` a command that works with any standard streams and can be interrupted at any time.

    - Ctrl-C ends the command at any time (`pipros.basics.interrupts`), without a traceback, with code 130
      unless the command handles Ctrl-C itself and returns another code.
    - A closed stream (`>&-`) is replaced by `/dev/null`, which child processes inherit, as in Noetic.
      Therefore, no file or socket that is opened later gets the stream's descriptor.
    - If an optional library is missing, the command ends with one line on standard error and code 1.
    - If a file cannot be used, and the command has no answer, it ends with one line and code 1.
    - If the system has no more descriptors, threads or memory for it, it ends with one line and code 1.
    - If output cannot be written, the command ends with one line on standard error and code 120.
    - If the reader of a pipe closes it (`| head`), the command ends silently with code 0.
    - A character that the stream's encoding lacks is written as an escape such as `\\xe9`, and so are the
      control characters of names and the like on terminals; see `for_terminal`.

    Output is flushed when the command returns. Streams that have replaced the process's own, as in tests, are
    left unchanged.
    """

    @wraps(main)
    def guarded(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> int:
        try:  # outermost, because Ctrl-C may arrive while the streams are being set up
            return with_streams(*args, **kwargs)
        except (KeyboardInterrupt, RuntimeError) as error:
            if not interrupts.is_interrupt(error):
                raise
            return INTERRUPTED

    def with_streams(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> int:
        interrupts.install()
        # At exit, Python need not search for reference cycles in memory that is about to be freed. Python
        # 3.14 aborts if DuckDB objects in such cycles are freed as late as that.
        if sys.version_info < (3, 14):
            atexit.register(gc.freeze)
        _open_closed_streams()
        before = sys.stdout
        sys.stdout, sys.stderr = _reporting_output(sys.stdout), _lenient(sys.stderr)
        for stream in (sys.stdout, sys.stderr):
            _escape_on_terminal(stream)
        try:
            try:
                return main(*args, **kwargs)
            finally:
                sys.stdout.flush()
        except MissingExtra as error:
            print(f"ERROR: {error}", file=sys.stderr)
            return 1
        except OutputFailed as error:
            discard_output()
            with contextlib.suppress(OSError, ValueError):
                print(f"ERROR: cannot write to standard output: {error.strerror}", file=sys.stderr)
            return OUTPUT_FAILED
        except BrokenPipeError:
            discard_output()
            return 0
        except (OSError, RuntimeError, MemoryError) as error:
            if scarce := _scarce(error):
                print(f"ERROR: {scarce}: end other programs, or raise the limit", file=sys.stderr)
                return 1
            if not isinstance(error, OSError):
                raise
            name = error.filename2 or error.filename
            if name is None and error.errno not in DISK_FULL:
                raise
            action = "write" if error.errno in DISK_FULL else "use"
            print(f"ERROR: cannot {action} {listed(name or 'a file')}: {error.strerror}", file=sys.stderr)
            return 1
        finally:
            if sys.stdout is not before:
                _replaced_streams.append(sys.stdout)
            sys.stdout = before

    return guarded


def _scarce(error: BaseException) -> str:
    """Return what the system lacks, with the command that shows its limit, or an empty text."""
    if isinstance(error, MemoryError):
        return "out of memory (ulimit -v)"
    if isinstance(error, RuntimeError):
        return f"{error} (ulimit -u, ulimit -v)" if "start new thread" in str(error) else ""
    is_scarce = getattr(error, "errno", None) in (errno.EMFILE, errno.ENFILE)
    return "too many open files and connections (ulimit -n)" if is_scarce else ""


def discard_output() -> None:
    """Send buffered and later output to the null device."""
    with contextlib.suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)
        sys.stdout.flush()


class _ReportingFile(io.FileIO):
    """The file behind standard output.

    OS errors other than BrokenPipeError are raised as `OutputFailed`, to distinguish them from errors of
    other files.
    """

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            raise
        except OSError as error:
            if ON_WINDOWS and error.errno == errno.EINVAL:  # a pipe that its reader has closed
                raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE)) from None
            raise OutputFailed(error.errno, error.strerror) from None


def _reporting_output(stream: Any) -> Any:
    buffer: Any = getattr(stream, "buffer", None)
    is_buffered = isinstance(buffer, io.BufferedWriter)
    raw = buffer.raw if is_buffered else buffer
    if stream is not sys.__stdout__ or not isinstance(stream, io.TextIOWrapper) or type(raw) is not io.FileIO:
        return stream
    stream.flush()
    reporting = _ReportingFile(raw.fileno(), "wb", closefd=False)
    return io.TextIOWrapper(
        io.BufferedWriter(reporting) if is_buffered else reporting,  # Python does not buffer with -u
        encoding=stream.encoding,
        errors=_lenient_errors(stream),
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _escape_on_terminal(stream: Any) -> None:
    if isinstance(stream, io.TextIOWrapper) and stream.isatty():
        write = stream.write
        setattr(stream, "write", lambda text: write(for_terminal(text)))  # noqa: B010  # a method, to mypy


def _lenient(stream: Any) -> Any:
    if stream is sys.__stderr__ and isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors=_lenient_errors(stream))
    return stream


def _lenient_errors(stream: Any) -> str:
    if stream.errors == "surrogateescape":  # in pipes on Windows, which lack most characters
        codecs.register_error("escaped", _escaped)
        return "escaped"
    return "backslashreplace" if stream.errors == "strict" else str(stream.errors)


def _escaped(error: UnicodeError) -> tuple[str | bytes, int]:
    """Write bytes that were decoded by `surrogateescape` as they were, and other characters as escapes."""
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.backslashreplace_errors(error)


def _open_closed_streams() -> None:
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is not None:
            continue
        null = os.open(os.devnull, os.O_RDWR)
        if null > number and not _is_open(number):
            os.dup2(null, number)
            os.close(null)
            null = number
        setattr(sys, name, open(null, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def _is_open(number: int) -> bool:
    try:
        os.fstat(number)
    except OSError:
        return False
    return True
