"""`rospy.topics.Poller`, a part of genuine rospy's transport."""

from rospy.impl.transport import InternalOfRospy


class Poller(InternalOfRospy):
    """Genuine rospy's detector of closed connections. In pipros, each link detects this itself."""
