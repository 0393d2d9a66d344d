"""Run a node that replaces a C++ program, with console output, log levels and shutdown like roscpp's."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator, Sequence

from pipros.basics.errors import Unreachable
from pipros.basics.printable import listed
from pipros.node.log import ros_logger
from pipros.node.log_outputs import open_console_and_file, open_rosout
from pipros.node.logger_services import serve_loggers
from pipros.node.node import Node
from pipros.node.signals import ended_by_signals
from pipros.node.start_params import is_on, set_private_params


@contextlib.contextmanager
def roscpp_program(
    name: str, package: str, argv: Sequence[str] | None = None, *, anonymous: bool = False
) -> Iterator[tuple[Node, logging.Logger]]:
    """Run a node within the context.

    Ctrl-C and SIGTERM shut the node down; the caller must check whether this has happened.

    Waits for the master. The records of the logger `ros` and its children are printed on the console in
    roscpp's format, and published on `/rosout`.

    Args:
        name: the node's name.
        package: the last part of the logger's name (`turtlesim` for `ros.turtlesim`).
        argv: the command-line arguments; defaults to those of the process.

    Yields:
        The node, and the logger.
    """
    everything = ros_logger("ros")
    ros_logger("ros.roscpp.superdebug")
    node = Node(
        name,
        anonymous=anonymous,
        argv=sys.argv[1:] if argv is None else argv,
        log=ros_logger("ros.roscpp"),
    )
    open_console_and_file(node, everything, None, is_roscpp=True)
    for handler in everything.handlers:
        handler.addFilter(_escaped)

    def report(_: Unreachable) -> None:
        place = node.environment.master_uri.removeprefix("http://").rstrip("/")
        node.log.error("[registerPublisher] Failed to contact master at [%s].  Retrying...", place)

    with ended_by_signals(node):
        node.wait_for_master(report)
        set_private_params(node, keep_texts=True)
        open_rosout(node, everything)
        if is_on(node, "/use_sim_time"):
            node.use_simulated_time()
        serve_loggers(node)
        yield node, ros_logger(f"ros.{package}")


def _escaped(record: logging.LogRecord) -> bool:
    """Escape control characters in a record's arguments: names and texts of peers."""
    if isinstance(record.args, tuple):
        record.args = tuple(
            listed(each) if isinstance(each, (str, Exception)) else each for each in record.args
        )
    return True
