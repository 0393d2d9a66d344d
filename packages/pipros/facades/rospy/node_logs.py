"""The node's log handlers for the console, the log file and `/rosout`."""

from __future__ import annotations

import logging

from pipros.node import Node
from pipros.node.log_outputs import open_console_and_file, open_rosout

_INTERNAL_LOGGERS = (
    *("rospy", "rospy.client", "rospy.core", "rospy.init", "rospy.internal", "rospy.registration"),
    *("rospy.impl", "rospy.impl.masterslave", "rospy.rosout", "rospy.service", "rospy.simtime"),
    *("rospy.tcpros", "rospy.topics", "rosgraph", "rosgraph.network", "xmlrpc"),
)
"""Loggers that tools expect a rospy node to list. Programs may also log with them."""


class NodeLogs:
    """The log handlers of the current node. After `close`, they can be opened for another node.

    Attributes:
        rosout_handler: the handler that publishes on `/rosout`, or None.
    """

    def __init__(self, logger: logging.Logger) -> None:
        self.rosout_handler: logging.Handler | None = None
        self._logger = logger
        self._handlers: list[logging.Handler] = []

    def open(self, node: Node, level: int | None) -> None:
        """Start logging to the console and to the node's log file."""
        self._handlers += open_console_and_file(node, self._logger, level)

    def open_rosout(self, node: Node) -> None:
        """Start publishing log messages on `/rosout`, unless already started."""
        if self.rosout_handler is None:
            self.rosout_handler = open_rosout(node, self._logger)
            self._handlers.append(self.rosout_handler)

    @staticmethod
    def create_internal_loggers() -> None:
        for name in _INTERNAL_LOGGERS:
            logging.getLogger(name)

    def close(self) -> None:
        """Remove and close the handlers."""
        for handler in self._handlers:
            self._logger.removeHandler(handler)
            logging.getLogger().removeHandler(handler)
            handler.close()
        self._handlers.clear()
        self.rosout_handler = None
