"""`rospy.topics.Poller`, which belongs to genuine rospy's transport."""

from rospy.impl.transport import InternalOfRospy


class Poller(InternalOfRospy):
    """Detector of closed connections in genuine rospy. In pipros, links detect this themselves."""
