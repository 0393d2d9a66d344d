"""Libraries on top of rospy in a node, one script each, in its own process."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.processes import Processes

HEAD = """
import threading
import rospy

def wait_for(condition):
    for _ in range(3000):
        if condition():
            return
        threading.Event().wait(0.01)
    raise SystemExit("what was waited for did not happen")

rospy.init_node("node")
"""

SYNCHRONIZED = """
import message_filters
from sensor_msgs.msg import CameraInfo, Image
subscribers = [message_filters.Subscriber("image", Image, queue_size=5)]
subscribers.append(message_filters.Subscriber("info", CameraInfo))
both = message_filters.ApproximateTimeSynchronizer(subscribers, 5, 0.1)
got = []
both.registerCallback(lambda image, info, more: got.append((image.width, info.width, more)), "more")
types = {"image": Image, "info": CameraInfo}
publishers = [rospy.Publisher(name, cls, queue_size=5) for name, cls in types.items()]
wait_for(lambda: all(publisher.get_num_connections() for publisher in publishers))
for publisher, message in zip(publishers, (Image(width=4), CameraInfo(width=5))):
    message.header.stamp = rospy.Time(10, len(got))
    publisher.publish(message)
wait_for(lambda: got)
one, other = subscribers
print(got, one.getTopic(), one.resolved_name, other.get_num_connections())
"""


ACTIONS = """
import subprocess
import sys

import actionlib
from actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus

OF_ANOTHER_TYPE = '''
import actionlib, rospy
from actionlib.msg import TwoIntsAction, TwoIntsGoal
rospy.init_node("other")
client = actionlib.SimpleActionClient("act", TwoIntsAction)
print(client.wait_for_server(rospy.Duration(0.5)))
client.send_goal(TwoIntsGoal(1, 2))
print(client.wait_for_result(rospy.Duration(0.2)))
'''

def serve():
    server = actionlib.SimpleActionServer("act", TestAction, None, auto_start=False)
    server.register_goal_callback(lambda: server.accept_new_goal())
    server.start()
    return server

server = serve()
forever = rospy.Duration(60)
client = actionlib.SimpleActionClient("act", TestAction)
print(client.wait_for_server(forever), client.get_state() == GoalStatus.LOST)

def raising(status, result):
    raise ValueError("by a callback")

client.send_goal(TestGoal(1), done_cb=raising)
wait_for(server.is_active)
server.set_succeeded(TestResult(5))
print("those who wait go on:", client.wait_for_result(forever), client.get_result().result)
client.cancel_goal()
print("done stays done:", client.get_state() == GoalStatus.SUCCEEDED, client.simple_state)

first = client.action_client.send_goal(TestGoal(2))
wait_for(lambda: first.get_comm_state() == actionlib.CommState.ACTIVE)
client.send_goal(TestGoal(3))
wait_for(lambda: first.get_comm_state() == actionlib.CommState.DONE)
print("replaced:", actionlib.TerminalState.to_string(first.get_terminal_state()))
server.set_succeeded()
server.set_aborted()  # too late, and only logged
print("the new one:", client.wait_for_result(forever), client.get_state() == GoalStatus.SUCCEEDED)

cancelled = []
other = actionlib.ActionServer("early", TestAction, lambda handle: cancelled.append("came"), auto_start=False)
other.start()
early = actionlib.ActionClient("early", TestAction)
early.wait_for_server(forever)
early.cancel_goals_at_and_before_time(rospy.Time.now() + rospy.Duration(3600))
wait_for(lambda: not other.last_cancel.is_zero())
handle = early.send_goal(TestGoal(4))
wait_for(lambda: handle.get_comm_state() == actionlib.CommState.DONE)
print("cancelled before:", actionlib.TerminalState.to_string(handle.get_terminal_state()), cancelled)

ended = subprocess.run([sys.executable, "-c", OF_ANOTHER_TYPE], capture_output=True, text=True)
print("of another type:", ended.stdout.split(), ended.returncode, server.is_active())
client.send_goal(TestGoal(6))
wait_for(server.is_active)
wait_for(lambda: client.get_state() == GoalStatus.ACTIVE)
server.stop()
server = serve()
print("lost with its server:", client.wait_for_result(forever), client.get_state() == GoalStatus.LOST)
try:
    actionlib.SimpleActionClient("x", TestGoal)
except actionlib.ActionException as error:
    print(str(error)[:29])
"""


RECONFIGURED = """
import subprocess
import sys
import types
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.server import Server
from pipros_libraries.reconfigure.cfg_file import module_contents
from pipros_libraries.reconfigure.generator import ParameterGenerator

generator = ParameterGenerator()
generator.add("gain", "double", 1, "A gain", 1.0, -5.0, 5.0)
generator.add_group("Inner").add("on", "bool", 2, "Whether", False)
declared = {"name": "Foo", "description": generator.group.to_dict(), "constants": []}
levels = []

def on_change(config, level):
    levels.append(level)
    if config.gain == 5.0:
        server.update_configuration({"gain": 4.0})  # from within the callback
        return server.config
    return config

server = Server(types.SimpleNamespace(**module_contents(declared)), on_change, "~")  # as without "~"
client = Client("node", timeout=60)
print(client.get_configuration(60)["gain"], client.update_configuration({"gain": 99})["gain"], levels)
print(client.update_configuration({"groups": {"Inner": False}})["groups"]["groups"]["Inner"]["state"])

def dynparam(*arguments):
    program = "import sys; from dynamic_reconfigure.dynparam import main; sys.exit(main())"
    ended = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True)
    return ended.returncode, ended.stdout.strip(), ended.stderr.strip()

print(dynparam("list"), dynparam("set", "node", "gain", "-2.5"))
print(dynparam("set", "node", '{"on": true, gain: -5}'), dynparam("dump", "node", "saved.yaml"))
print(open("saved.yaml").read().split())
print(dynparam("set", "node", "nothing", "1"))
print(dynparam("load", "node", "saved.yaml"), server.config.gain, server.config.on)
"""


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        pytest.param(
            RECONFIGURED,
            [
                "1.0 4.0 [-1, 1, 1]",
                "False",
                "(0, '/node', '') (0, '', '')",
                "(0, '', '') (0, '', '')",
                "['\"on\":', 'true', 'gain:', '-5.0']",
                "(1, '', \"error updating parameters: don't know parameter: nothing\")",
                "(0, '', '') -5.0 True",
            ],
            id="parameters",
        ),
        pytest.param(
            ACTIONS,
            [
                "True True",
                "those who wait go on: True 5",
                "done stays done: True 2",
                "replaced: PREEMPTED",
                "the new one: True True",
                "cancelled before: RECALLED []",
                "of another type: ['False', 'False'] 0 False",
                "lost with its server: True True",
                "Type is not an action spec: <",
            ],
            id="goals",
        ),
    ],
)
def test_a_script_prints(
    script: str, expected: list[str], processes: Processes, tmp_path: Path, master: Master
) -> None:
    file = tmp_path / "script.py"
    file.write_text(HEAD + script)
    environment = {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path)}
    ended = processes.run(sys.executable, file, timeout_s=120.0, environment=environment)

    assert [line for line in ended.stdout if not line.startswith("[") or line in expected] == expected, (
        ended.output
    )


def test_topics_are_synchronized(processes: Processes, tmp_path: Path, master: Master) -> None:
    test_a_script_prints(SYNCHRONIZED, ["[(4, 5, 'more')] image /image 1"], processes, tmp_path, master)
