"""A node whose parameters, from the JSON file in the argument after its name, can be reconfigured."""

import json
import sys
import types

import rospy
from dynamic_reconfigure.server import Server


def on_change(config, level):
    print(level, {name: value for name, value in config.items() if name != "groups"}, flush=True)
    return config


with open(sys.argv[2]) as file:
    module = types.SimpleNamespace(**json.load(file))
rospy.init_node(sys.argv[1])
server = Server(module, on_change)
rospy.spin()
