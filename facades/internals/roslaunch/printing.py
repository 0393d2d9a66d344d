"""What launchers print, and the handlers that scripts add to hear it, too."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from pipros.launch.console import Console

Handler = Callable[[str], object]

_console = Console(has_title=False)
_handlers: list[Handler] = []
_error_handlers: list[Handler] = []


def _tell(handlers: list[Handler], msg: str) -> None:
    for handler in handlers:
        with suppress(Exception):  # a handler must not end a launch
            handler(msg)


def printlog(msg: str) -> None:
    """Prints to standard output, and tells the handlers."""
    _tell(_handlers, msg)
    _console.say(msg)


def printlog_bold(msg: str) -> None:
    """As `printlog`, in bold letters."""
    _tell(_handlers, msg)
    _console.bold(msg)


def printerrlog(msg: str) -> None:
    """Prints to standard error in red, and tells the handlers of errors."""
    _tell(_error_handlers, msg)
    _console.error(msg)


def add_printlog_handler(h: Handler) -> None:
    """From now on `h` is called with each text of `printlog` and `printlog_bold`."""
    _handlers.append(h)


def add_printerrlog_handler(h: Handler) -> None:
    """From now on `h` is called with each text of `printerrlog`."""
    _error_handlers.append(h)


def clear_printlog_handlers() -> None:
    """Forgets all handlers of `printlog`."""
    _handlers.clear()


def clear_printerrlog_handlers() -> None:
    """Forgets all handlers of `printerrlog`."""
    _error_handlers.clear()
