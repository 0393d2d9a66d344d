"""A genuine rclpy node that prints the first short text on `/texts` and whether its source time is recent."""

import time

import rclpy
from std_msgs.msg import String

has_short = False


def take(message, info):
    global has_short
    if not has_short and len(message.data) < 100:
        has_short = True
        age_s = time.time() - info["source_timestamp"] / 1e9
        print("short", message.data.strip(), "recent" if 0 <= age_s < 600 else age_s, flush=True)


rclpy.init()
node = rclpy.create_node("listener")
subscription = node.create_subscription(String, "/texts", take, 10)
print("ready", flush=True)
rclpy.spin(node)
