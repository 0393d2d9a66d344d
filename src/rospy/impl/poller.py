"""`rospy.topics.Poller`, of genuine rospy's transport."""

from rospy.impl.transport import InternalOfRospy


class Poller(InternalOfRospy):
    """Notices that connections were closed; links of pipros do so themselves."""
