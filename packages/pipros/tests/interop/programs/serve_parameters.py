"""Serve the configuration in the JSON file of the argument, and print the calls of the callback."""

import json
import sys
import types

import rospy
from dynamic_reconfigure.server import Server

with open(sys.argv[1]) as file:
    module = types.SimpleNamespace(**json.load(file))


def on_change(config, level):
    print(level, sorted((name, value) for name, value in config.items() if name != "groups"), flush=True)
    if config["size"] == 1:
        config["name"] = "middle"
    return config


rospy.init_node("tuned")
if rospy.has_param("/tuned"):
    rospy.delete_param("/tuned")  # of an earlier server
rospy.set_param("~gain", 2.5)
rospy.set_param("~count", 99)
server = Server(module, on_change)
rospy.spin()
