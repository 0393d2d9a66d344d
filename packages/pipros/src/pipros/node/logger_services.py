"""The services `~get_loggers` and `~set_logger_level`, which every ROS node has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.msg import load_message_class, load_service_class
from pipros.node.log import logger_count, logger_exists, logger_levels, set_logger_level

if TYPE_CHECKING:
    from pipros.node.node import Node

LOGGERS = 1000
"""Limit: loggers that callers of `~set_logger_level` create in a node. Beyond it, the level is not set,
which is logged once; the names of new loggers can have at most 200 characters; the limit does not count
loggers that the program creates.
"""

_NAME_CHARACTERS = 200


def serve_loggers(node: Node) -> None:
    """Offer both services for the loggers in this process.

    As in Noetic, a level can be set before the program creates the logger. Loggers live as long as the
    process, so their number is limited.
    """
    created = 0
    has_warned = False
    get_class: Any = load_service_class("roscpp/GetLoggers")
    set_class: Any = load_service_class("roscpp/SetLoggerLevel")
    logger_class = load_message_class("roscpp/Logger")

    def get_loggers(_: Any) -> Any:
        loggers = [logger_class(name=name, level=level) for name, level in logger_levels()]
        return get_class._response_class(loggers=loggers)

    def set_level(request: Any) -> Any:
        nonlocal created, has_warned
        name = request.logger
        if logger_exists(name):
            set_logger_level(name, request.level)
        elif len(name) <= _NAME_CHARACTERS and created < LOGGERS:
            before = logger_count()
            set_logger_level(name, request.level)
            created += logger_count() - before
        elif not has_warned:
            has_warned = True
            node.log.warning(
                "~set_logger_level did not create a logger: names have at most %d characters, and %s",
                _NAME_CHARACTERS,
                f"the limit is {LOGGERS}",
            )
        return set_class._response_class()

    node.serve("~get_loggers", get_class, get_loggers)
    node.serve("~set_logger_level", set_class, set_level)
