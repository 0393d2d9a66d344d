"""Run the lines of message_corners.txt with the installed genpy, to compare implementations.

A line is a series of statements separated by ` ;; `; its outcome is the value of the last, or the exception.
Run as a script by the Python of genuine ROS; prints the outcomes as a JSON object.
"""

import copy
import io
import json
import os
import pickle
import sys

import genmsg
import genmsg.msg_loader
import genpy
import genpy.base
import genpy.dynamic
import genpy.message
import roslib.message
import rospy

CORNERS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "message_corners.txt")
PACKAGES = ("std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "diagnostic_msgs", "rosgraph_msgs")


def ser(message):
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def made(text, name="made/T"):
    return genpy.dynamic.generate_dynamic(name, text)[name]


def load_srv(text, name):
    return genmsg.msg_loader.load_srv_from_string(genmsg.MsgContext.create_default(), text, name)


def show(value):
    """A value with the types of all its parts."""
    if isinstance(value, bytes):
        return f"bytes:{value.hex()}"
    if isinstance(value, (list, tuple)):
        return f"{type(value).__name__}[{', '.join(map(show, value))}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{show(key)}:{show(each)}" for key, each in value.items()) + "}"
    return f"{type(value).__name__}:{value!r}"


def names():
    found = {"copy": copy, "io": io, "pickle": pickle}
    found |= {"genmsg": genmsg, "genpy": genpy, "roslib": roslib, "rospy": rospy}
    found |= {"ser": ser, "made": made, "load_srv": load_srv, "show": show}
    for package in PACKAGES:
        exec(f"from {package}.msg import *", found)  # noqa: S102
    exec("from std_srvs.srv import *", found)  # noqa: S102
    message = genpy.message
    found |= {"fill": message.fill_message_args, "strify": message.strify_message}
    found |= {"printable": message.get_printable_message_args, "check_type": message.check_type}
    found |= {"message_class": message.get_message_class, "service_class": message.get_service_class}
    found["dynamic"] = genpy.dynamic.generate_dynamic
    return found


def outcome(line, known):
    known = dict(known)
    *statements, last = line.split(" ;; ")
    try:
        for statement in statements:
            exec(statement, known)  # noqa: S102
        try:
            return show(eval(last, known))  # noqa: S307
        except SyntaxError:
            exec(last, known)  # noqa: S102
            return "done"
    except Exception as error:
        return f"{type(error).__module__}.{type(error).__name__}: {error}"


def outcomes():
    with open(CORNERS, encoding="utf-8") as file:
        lines = [line.rstrip("\n") for line in file if not line.startswith("#")]
    known = names()
    return {line: outcome(line, known) for line in lines}


if __name__ == "__main__":
    json.dump(outcomes(), sys.stdout)
