"""Open a node's log outputs: the console, a file and `/rosout`."""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path
from typing import Any

from pipros.basics.errors import Refused, Unreachable
from pipros.node.log import (
    ConsoleHandler,
    RosoutHandler,
    configure_by_file,
    find_log_config,
    log_file,
    open_file_handler,
)
from pipros.node.node import Node
from pipros.node.publisher import Publisher

_ROSOUT_QUEUE_SIZE = 100

_LOGGING_LEVELS = {
    1: logging.DEBUG,
    2: logging.INFO,
    4: logging.WARNING,
    8: logging.ERROR,
    16: logging.CRITICAL,
}
"""Levels of Python's logging, by ROS level number."""


def open_console_and_file(
    node: Node, logger: logging.Logger, level: int | None, *, is_roscpp: bool = False
) -> list[logging.Handler]:
    """Write `logger`'s records to the console, and all loggers' records to a file, as in Noetic.

    If there is a usable Python logging configuration (`find_log_config`), it is used instead.

    Args:
        level: a ROS level number; None keeps the configured level.
        is_roscpp: see `ConsoleHandler`.

    Returns:
        The handlers that were added to the logger and to the root logger; an empty list if such a
        configuration is used.

    Raises:
        KeyError: there is no such level, as in Noetic.
    """
    if level is not None and level not in _LOGGING_LEVELS:
        raise KeyError(f"log_level must be rospy.DEBUG, INFO, WARN, ERROR or FATAL, got {level!r}")
    handlers: list[logging.Handler] = []
    given = node.identity.arguments.special.get("__log")
    path = log_file(node.environment.log_dir, node.name, given)
    config = find_log_config(node.environment)
    if config is None or not configure_by_file(config, path):
        logger.setLevel(logging.INFO)
        for handler in logger.handlers[:]:
            # an output that the program opened before it started the node
            if isinstance(handler, ConsoleHandler):
                logger.removeHandler(handler)
        console = ConsoleHandler(
            node.name, lambda: node.clock, node.environment.console_format, is_roscpp=is_roscpp
        )
        logger.addHandler(console)
        handlers = [console, _log_to_file(path)]
    if level is not None:
        logger.setLevel(_LOGGING_LEVELS[level])
    return handlers


def _log_to_file(path: Path) -> logging.Handler:
    root, handler = logging.getLogger(), open_file_handler(path)
    root.addHandler(handler)
    root.setLevel(min(root.level or logging.INFO, logging.INFO))
    return handler


def open_rosout(node: Node, logger: logging.Logger) -> RosoutHandler:
    """Publish `logger`'s records on `/rosout`.

    The messages list the topics that the node publishes, unless the parameter
    `/rosout_disable_topics_generation` is true.

    Returns:
        The handler that was added to the logger.
    """
    from pipros.msg import load_message_class

    publisher: Publisher[Any] = node.advertise(
        "/rosout", load_message_class("rosgraph_msgs/Log"), queue_size=_ROSOUT_QUEUE_SIZE, latch=True
    )

    def topics() -> list[str]:
        return [publication.topic for publication in node.endpoints.publications]

    names_topics = True
    with contextlib.suppress(LookupError, Unreachable, Refused):
        names_topics = not node.params.get_cached("/rosout_disable_topics_generation")
    handler = RosoutHandler(publisher, node.name, lambda: node.clock, topics if names_topics else list)
    logger.addHandler(handler)
    return handler
