"""`rospy.impl.statistics`: genuine rospy's topic statistics; see `pipros.node.topic_statistics`."""

from pipros.basics.lazy_names import star_names as _star_names
from rospy.impl.transport import InternalOfRospy

_star_names(__name__, "logging rospy math:sqrt sys rosgraph_msgs.msg:TopicStatistics")


class SubscriberStatisticsLogger(InternalOfRospy):
    """Statistics on a subscription's connections in genuine rospy."""


class ConnectionStatisticsLogger(InternalOfRospy):
    """Statistics on one connection in genuine rospy."""
