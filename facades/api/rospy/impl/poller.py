"""`rospy.topics.Poller`, of genuine rospy's transport."""

from rospy.impl.transport import InternalOfRospy


class Poller(InternalOfRospy):
    """Detects closed connections in genuine rospy; pipros links do so themselves."""
