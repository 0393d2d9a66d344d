"""A node for the tasks of test_tasks.py: a service, a wrong topic name, and a parameter with an effect.

The argument is the JSON file of the configuration."""

import json
import sys
import types

from sensor_msgs.msg import Image
from std_msgs.msg import Float64
from std_srvs.srv import Trigger, TriggerResponse

import rospy
from dynamic_reconfigure.server import Server

with open(sys.argv[1]) as file:
    module = types.SimpleNamespace(**json.load(file))
rospy.init_node("driver")
gains = []
server = Server(module, lambda config, _: gains.append(config["gain"]) or config)
rospy.Service("reset_odometry", Trigger, lambda _: TriggerResponse(True, "reset"))
rospy.Subscriber("/left/image_rect", Image, lambda _: None)
rospy.Subscriber("/wish", Float64, lambda _: None)
speeds = rospy.Publisher("speed", Float64, queue_size=1)
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    speeds.publish(gains[-1])
    rate.sleep()
