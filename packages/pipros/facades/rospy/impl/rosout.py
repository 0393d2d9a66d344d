"""`rospy.impl.rosout`: log output to `/rosout`."""

from __future__ import annotations

import logging

from pipros.basics.lazy_names import star_names as _star_names
from rospy.exceptions import ROSException as ROSException
from rospy.impl.registration import get_topic_manager as get_topic_manager
from rospy.names import get_caller_id as get_caller_id
from rospy.rostime import Time as Time
from rospy.session import session
from rospy.topics import Publisher as Publisher
from rospy.topics import Subscriber as Subscriber

_star_names(__name__, "rosgraph_msgs.msg:Log rospy sys traceback")

_rospy_to_logging_levels = {
    1: logging.DEBUG,
    2: logging.INFO,
    4: logging.WARNING,
    8: logging.ERROR,
    16: logging.CRITICAL,
}
_logging_to_rospy_levels = {number: level for level, number in _rospy_to_logging_levels.items()}


class RosOutHandler(logging.Handler):
    """Handler that publishes log records on `/rosout`, like the node's own handler.

    Before `init_node`, it publishes nothing. The logger `rosout` already has such a handler, so add this one
    to a different logger.
    """

    def emit(self, record: logging.LogRecord) -> None:
        """Publish a record."""
        if session.logs.rosout_handler is not None:
            session.logs.rosout_handler.emit(record)


def init_rosout() -> None:
    """Advertise `/rosout` after `init_node(disable_rosout=True)`; otherwise, do nothing."""
    if session.node is not None:
        session.logs.open_rosout(session.node)


def load_rosout_handlers(level: int) -> None:
    """Set the lowest ROS level to log, such as `rospy.INFO`, and call `init_rosout`.

    The level also applies to the console and the log file.
    """
    init_rosout()
    session.logger.setLevel(_rospy_to_logging_levels[level])
