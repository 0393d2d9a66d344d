"""The services `~get_loggers` and `~set_logger_level`, which every ROS node has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.msg import load_message_class, load_service_class
from pipros.node.log import logger_levels, set_logger_level

if TYPE_CHECKING:
    from pipros.node.node import Node


def serve_loggers(node: Node) -> None:
    """Offer both services, for the loggers of this process."""
    get_class: Any = load_service_class("roscpp/GetLoggers")
    set_class: Any = load_service_class("roscpp/SetLoggerLevel")
    logger_class = load_message_class("roscpp/Logger")

    def get_loggers(_: Any) -> Any:
        loggers = [logger_class(name=name, level=level) for name, level in logger_levels()]
        return get_class._response_class(loggers=loggers)

    def set_level(request: Any) -> Any:
        set_logger_level(request.logger, request.level)
        return set_class._response_class()

    node.serve("~get_loggers", get_class, get_loggers)
    node.serve("~set_logger_level", set_class, set_level)
