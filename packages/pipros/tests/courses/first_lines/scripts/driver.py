#!/usr/bin/python
"""Ask for a speed, as a person with a joystick does."""
import rospy
from geometry_msgs.msg import Twist


def drive():
    rospy.init_node("driver", anonymous=True)
    publisher = rospy.Publisher("wanted", Twist, queue_size=1)
    rate = rospy.Rate(20)
    while not rospy.is_shutdown():
        wanted = Twist()
        wanted.linear.x = 0.2
        publisher.publish(wanted)
        rate.sleep()


if __name__ == "__main__":
    try:
        drive()
    except rospy.ROSInterruptException:
        pass
