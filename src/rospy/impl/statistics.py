"""`rospy.impl.statistics`: genuine rospy's topic statistics; see `pipros.node.topic_statistics`."""

from rospy.impl.transport import InternalOfRospy


class SubscriberStatisticsLogger(InternalOfRospy):
    """Measures the connections of a subscription."""


class ConnectionStatisticsLogger(InternalOfRospy):
    """Measures one connection."""
