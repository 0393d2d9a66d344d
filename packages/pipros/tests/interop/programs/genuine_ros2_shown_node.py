"""A genuine rclpy node with one endpoint of each kind, for tests of commands that look at ROS 2."""

import rclpy
from rclpy.action import ActionServer
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci


def switch(request, response):
    response.success, response.message = request.data, "é"
    return response


def execute(goal):
    goal.succeed()
    return Fibonacci.Result()


rclpy.init()
node = rclpy.create_node("shown", namespace="/robot")
chatter = node.create_publisher(String, "/chatter", 10)
scan = node.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
kept = node.create_publisher(
    String, "/kept", QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
)
kept.publish(String(data="kept: é"))
message = LaserScan(ranges=[1.5] * 200)
message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id = 1, 2, "laser"


def send():
    chatter.publish(String(data="hello"))
    scan.publish(message)


node.create_timer(0.05, send)
node.create_subscription(String, "/heard", lambda heard: print("heard", heard.data, flush=True), 10)
node.create_service(SetBool, "/switch", switch)
server = ActionServer(node, Fibonacci, "/fibonacci", execute)
print("ready", flush=True)
rclpy.spin(node)
