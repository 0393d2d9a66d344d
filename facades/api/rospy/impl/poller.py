"""`rospy.topics.Poller`, a part of genuine rospy's transport."""

from rospy.impl.transport import InternalOfRospy


class Poller(InternalOfRospy):
    """Detects closed connections in genuine rospy. pipros's links detect them themselves."""
