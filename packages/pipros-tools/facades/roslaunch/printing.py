"""Output functions of launchers, and handlers that pass the output to scripts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from pipros_tools.launch.console import Console

Handler = Callable[[str], object]

_console = Console(has_title=False)
_handlers: list[Handler] = []
_error_handlers: list[Handler] = []


def _notify(handlers: list[Handler], msg: str) -> None:
    for handler in handlers:
        with suppress(Exception):  # an exception in a handler must not end a launch
            handler(msg)


def printlog(msg: str) -> None:
    """Print to standard output, and call the handlers."""
    _notify(_handlers, msg)
    _console.say(msg)


def printlog_bold(msg: str) -> None:
    """Print to standard output in bold, and call the handlers of `printlog`."""
    _notify(_handlers, msg)
    _console.bold(msg)


def printerrlog(msg: str) -> None:
    """Print to standard error in red, and call the error handlers."""
    _notify(_error_handlers, msg)
    _console.error(msg)


def add_printlog_handler(h: Handler) -> None:
    """Add a handler that is called with each string printed by `printlog` or `printlog_bold`."""
    _handlers.append(h)


def add_printerrlog_handler(h: Handler) -> None:
    """Add a handler that is called with each string printed by `printerrlog`."""
    _error_handlers.append(h)


def clear_printlog_handlers() -> None:
    """Remove all handlers of `printlog`."""
    _handlers.clear()


def clear_printerrlog_handlers() -> None:
    """Remove all handlers of `printerrlog`."""
    _error_handlers.clear()
