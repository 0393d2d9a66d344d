"""The console handler of ROS, by the name that logging configuration files use."""

from __future__ import annotations

import logging
import os
import sys
from typing import Any

from pipros.node.log import ConsoleHandler


class RosStreamHandler(ConsoleHandler):
    """Writes in the format of `ROSCONSOLE_FORMAT`: DEBUG and INFO to stdout, the rest to stderr."""

    def __init__(self, colorize: bool = True) -> None:
        super().__init__("", lambda: None, os.environ.get("ROSCONSOLE_FORMAT"), is_coloured=colorize)

    def emit(self, record: logging.LogRecord) -> None:
        rospy: Any = sys.modules.get("rospy.session")  # a configuration is read before there is a node
        if rospy is not None:
            node = rospy.session.node
            self.node_name = rospy.session.name
            self.clock = lambda: node.clock if node is not None else None
        super().emit(record)
