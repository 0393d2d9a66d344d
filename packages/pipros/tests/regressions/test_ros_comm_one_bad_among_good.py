"""ros_comm: one bad callback, handler, hook, message or parameter took the good ones beside it along."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.nodes import MakeNode
from tests.support.processes import Processes

SCRIPT = """
import time

import rospy
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, SetBoolResponse

def wait(condition):
    end = time.monotonic() + 30
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)

def on_message(number):
    def callback(message):
        got.append((message.data, number))
        if number == 1:
            subscribers[1].unregister()
        if number == 0:
            raise ValueError("bad callback")
    return callback

rospy.init_node("node")
got, hooks = [], []
subscribers = [rospy.Subscriber("topic", Int32, on_message(number)) for number in range(4)]
publisher = rospy.Publisher("topic", Int32, queue_size=10)
wait(publisher.get_num_connections)
for value in (1, 2**40, "x", 2):
    try:
        publisher.publish(value)
    except rospy.ROSException as error:
        print("publish:", type(error).__name__)
wait(lambda: len(got) == 7)
print(sorted(got))

answers = iter([None, "text", [True], SetBoolResponse(True, "good"), {"success": True}])
rospy.Service("set", SetBool, lambda request: next(answers))
proxy = rospy.ServiceProxy("set", SetBool, persistent=True)
for _ in range(6):
    try:
        print("call:", proxy(True).success)
    except rospy.ServiceException:
        print("call: failed")

def bad_hook():
    raise RuntimeError("bad hook")

for hook in (lambda: hooks.append(1), bad_hook, lambda: hooks.append(2)):
    rospy.on_shutdown(hook)
rospy.signal_shutdown("end")
print(hooks)
"""


def test_what_is_beside_a_bad_one_goes_on(processes: Processes, tmp_path: Path, master: Master) -> None:
    (script := tmp_path / "node.py").write_text(SCRIPT)
    node = processes.run(sys.executable, str(script), environment={"ROS_MASTER_URI": master.uri})
    assert [line for line in node.stdout if line.startswith(("publish:", "call:", "["))] == [
        *["publish: ROSSerializationException"] * 2,
        "[(1, 0), (1, 1), (1, 2), (1, 3), (2, 0), (2, 2), (2, 3)]",
        *["call: failed", "call: failed", "call: failed", "call: True", "call: True", "call: failed"],
        "[1, 2]",
    ], node.output


def test_a_parameter_that_cannot_be_sent_changes_nothing(make_node: MakeNode) -> None:
    params = make_node("node").params
    good = {"küche": "ü🤖", "a/b": math.inf, "": [], "empty": {}, "nan": -math.inf, "tab": "a\t b "}
    params.set("/good", good)
    for bad in ({"x": 1, "y": None}, {"x": 2**31}, {"x": "a\0b"}, {1: 2}, ["\udcff"]):
        with pytest.raises((TypeError, ValueError, OverflowError)):
            params.set("/good", bad)
    assert params.get("/good") == good
