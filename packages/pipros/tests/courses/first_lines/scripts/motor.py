#!/usr/bin/python
"""Turn the wheels: publish the ticks of the encoder."""
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Int32


class Motor:
    def __init__(self):
        self.speed = 0.0
        self.ticks = 0.0
        self.publisher = rospy.Publisher("ticks", Int32, queue_size=10)
        rospy.Subscriber("cmd_vel", Twist, self.command)
        rospy.Timer(rospy.Duration(0.05), self.turn)

    def command(self, message):
        self.speed = message.linear.x

    def turn(self, _event):
        self.ticks += 100 * self.speed
        self.publisher.publish(int(self.ticks))


rospy.init_node("motor")
Motor()
rospy.spin()
