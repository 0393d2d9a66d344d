"""A client with roslibpy, which uses all features of a robot and prints the results as JSON.

python client.py PORT
"""

import contextlib
import json
import sys
import threading
import time

import roslibpy

try:
    from roslibpy.ros1 import actionlib
    from roslibpy.tf import TFClient
except ImportError:  # version 1
    from roslibpy import actionlib
    from roslibpy.tf import TFClient


def first_message(topic, while_waiting=lambda: None):
    """Return the data of the next message on a topic."""
    came, messages = threading.Event(), []

    def keep(message):
        messages.append(message["data"])
        came.set()

    topic.subscribe(keep)
    while not came.wait(0.1):
        while_waiting()
    topic.unsubscribe()
    return messages[0]


ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
ros.run(timeout=60)
found = {}
found["none"] = first_message(roslibpy.Topic(ros, "/latched", "std_msgs/String"))
command = roslibpy.Topic(ros, "/cmd", "std_msgs/String")
echo = roslibpy.Topic(ros, "/echo", "std_msgs/String")
found["echo"] = first_message(echo, lambda: command.publish(roslibpy.Message({"data": "from py"})))
enable = roslibpy.Service(ros, "/enable", "std_srvs/SetBool")
found["robot's"] = dict(enable.call(roslibpy.ServiceRequest({"data": True}), timeout=60))


def switch(request, response):
    """Answer a call of the offered service."""
    response["success"], response["message"] = request["data"], "from py"
    return True


offered = roslibpy.Service(ros, "/switch", "std_srvs/SetBool")
offered.advertise(switch)
while ros.get_service_type("/switch") != "std_srvs/SetBool":
    time.sleep(0.05)
own = roslibpy.Service(ros, "/switch", "std_srvs/SetBool")
found["own"] = dict(own.call(roslibpy.ServiceRequest({"data": True}), timeout=60))
parameter = roslibpy.Param(ros, "/from_py")
parameter.set([1, {"a": 2.5}])
found["parameter"] = parameter.get()
found["type"] = ros.get_topic_type("/echo")
found["robot"] = sorted(ros.get_node_details("/robot")["publishing"])[:2]

client = actionlib.ActionClient(ros, "/count", "actionlib/TestAction")
while not {"feedback", "result"} <= found.keys():  # the client does not wait until both reach it
    goal = actionlib.Goal(client, roslibpy.Message({"goal": 21}))
    goal.on("feedback", lambda each: found.__setitem__("feedback", each["feedback"]))
    goal.send()
    with contextlib.suppress(roslibpy.core.RosTimeoutError):
        found["result"] = goal.wait(3)["result"]
came = threading.Event()


def keep_transform(transform):
    """Keep the transform of a frame."""
    found["arm"] = transform["translation"]
    came.set()


tf_client = TFClient(ros, fixed_frame="world", angular_threshold=0.01, translation_threshold=0.01)
tf_client.subscribe("arm", keep_transform)
came.wait(60)
print(json.dumps(found), flush=True)
ros.terminate()
