"""Constants of rospy's transport, by their old address."""

from rospy.topics import DEFAULT_BUFF_SIZE as DEFAULT_BUFF_SIZE
