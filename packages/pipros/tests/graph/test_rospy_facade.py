"""Parts of rospy and of libraries on top of it that need a node, one script each, in its own process."""

import json
import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.processes import Processes

# Parts of rospy that need a node, one script each, in its own process.


HEAD = """
import threading
import rospy
from std_msgs.msg import Float32MultiArray, String

def wait_for(condition):
    for _ in range(3000):
        if condition():
            return
        rospy.sleep(0.01)  # without threads, callbacks run meanwhile
    raise SystemExit("what was waited for did not happen")

rospy.init_node("node")
"""

NUMPY = """
import numpy
from rospy.numpy_msg import numpy_msg
got = []
rospy.Subscriber("floats", numpy_msg(Float32MultiArray), got.append)
pub = rospy.Publisher("floats", numpy_msg(Float32MultiArray), queue_size=5)
wait_for(pub.get_num_connections)
array = numpy.array([1.5, 2.5], dtype=numpy.float32)
pub.publish(Float32MultiArray(data=array))
pub.publish(data=array * 2)
wait_for(lambda: len(got) == 2)
assert numpy_msg(Float32MultiArray) is numpy_msg(Float32MultiArray)
assert isinstance(got[0], Float32MultiArray) and got[0]._type == "std_msgs/Float32MultiArray"
print([(type(m.data).__name__, m.data.dtype.name, m.data.tolist()) for m in got])
"""

LISTENER = """
events = []

class Ear(rospy.SubscribeListener):
    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        events.append(("come", topic_name))
        peer_publish(String("for you"))
        topic_publish(String("for all"))

    def peer_unsubscribe(self, topic_name, num_peers):
        events.append(("gone", topic_name, num_peers))

pub = rospy.Publisher("chat", String, subscriber_listener=Ear(), queue_size=5)
got = []
sub = rospy.Subscriber("chat", String, got.append)
wait_for(lambda: len(got) == 2)
sub.unregister()
wait_for(lambda: len(events) == 2)
print(events, [m.data for m in got])
"""

STATISTICS = """
from rosgraph_msgs.msg import TopicStatistics
got = []
rospy.Subscriber("/statistics", TopicStatistics, got.append)
rospy.Subscriber("chat", String, lambda _: None)
pub = rospy.Publisher("chat", String, queue_size=0)
wait_for(pub.get_num_connections)
def statistics():
    pub.publish("x")
    return got
wait_for(statistics)
m = got[0]
print(m.topic, m.node_pub, m.node_sub, m.traffic == m.delivered_msgs * 5, m.dropped_msgs)
print(m.window_stop > m.window_start)
"""

ROSOUT = """
import os, sys
from rosgraph_msgs.msg import Log
got = []
rospy.Subscriber("/rosout", Log, got.append)
wait_for(lambda: any(n for n in rospy.core.session.node.endpoints.publication("/rosout").links))
def say():
    rospy.logwarn("low %d", 5)
say()
wait_for(lambda: any(m.msg == "low 5" for m in got))
m = [m for m in got if m.msg == "low 5"][0]
is_base = m.file == os.path.basename(sys.argv[0])
print(m.level, m.name, m.msg, is_base, m.function, m.topics, m.header.stamp.secs > 0)
rospy.logdebug("not there")
rospy.loginfo("last")
wait_for(lambda: any(m.msg == "last" for m in got))
print(any(m.msg == "not there" for m in got))
"""

WAITING_AGAIN_AND_AGAIN = """
import gc
pub = rospy.Publisher("chat", String, queue_size=1, latch=True)
pub.publish("x")
def wait_often(times):
    for _ in range(times):
        rospy.wait_for_message("chat", String, 10)
    gc.collect()
    return sum(isinstance(thing, threading.Event) for thing in gc.get_objects())
few = wait_often(3)
print(wait_often(20) < few + 10)
"""

THROTTLED = """
import logging
said = []
logging.getLogger("rosout").addFilter(lambda record: said.append(record.getMessage()) or True)
for number in range(2):
    rospy.loginfo_throttle(rospy.Duration(60), f"once {number}")
    rospy.loginfo_throttle_identical(rospy.Duration(60), "the same")
    rospy.loginfo_throttle(rospy.Duration(0), f"always {number}")
print(said)
"""


LOGGED = """
logged = [log("x") for log in (rospy.logdebug, rospy.loginfo, rospy.logwarn, rospy.logerr, rospy.logfatal)]
print(logged, rospy.is_shutdown_requested())
for kind in ("throttle", "throttle_identical", "once"):
    log = getattr(rospy, f"loginfo_{kind}")
    print(kind, [log(*([60] if kind != "once" else []), "x") for _ in range(3)])
"""


@pytest.mark.parametrize(
    ("code", "parameters", "expected"),
    [
        (NUMPY, {}, ["[('ndarray', 'float32', [1.5, 2.5]), ('ndarray', 'float32', [3.0, 5.0])]"]),
        (LISTENER, {}, ["[('come', '/chat'), ('gone', '/chat', 0)] ['for you', 'for all']"]),
        (STATISTICS, {"/enable_statistics": True}, ["/chat /node /node True 0", "True"]),
        (ROSOUT, {}, ["4 /node low 5 True say ['/rosout'] True", "False"]),
        (WAITING_AGAIN_AND_AGAIN, {}, ["True"]),
        (THROTTLED, {}, ["['once 0', 'the same', 'always 0', 'always 1']"]),
        (
            LOGGED,
            {},
            [
                "[True, True, True, True, True] False", "throttle [True, False, False]",
                "throttle_identical [True, False, False]", "once [True, False, False]",
            ],
        ),
    ],
    ids=[
        "numpy_msg", "SubscribeListener", "statistics", "rosout", "nothing is left of a wait",
        "throttled by durations", "logging says whether it logged",
    ],
)  # fmt: skip
def test_it_prints_the_lines_of_noetic(
    processes: Processes,
    tmp_path: Path,
    master: Master,
    client: MasterClient,
    code: str,
    parameters: dict[str, object],
    expected: list[str],
) -> None:
    for name, value in parameters.items():
        client.set_param(name, value)
    script = tmp_path / "node.py"
    script.write_text(HEAD + code + 'rospy.signal_shutdown("done")\n')
    node = processes.run(sys.executable, str(script), environment={"ROS_MASTER_URI": master.uri})
    assert node.returncode == 0, node.output
    assert [line for line in node.stdout if not line.startswith("[INFO]")] == expected


def test_all_loggers_of_a_process_write_to_its_log_file_as_in_noetic(processes, tmp_path, master) -> None:
    script = tmp_path / "node.py"
    script.write_text(
        'import logging, rospy\nrospy.init_node("node")\nlogging.getLogger("mine").info("own words")\n'
        'rospy.loginfo("to all")\nrospy.logdebug("not logged")\n'
    )
    variables = {"ROS_MASTER_URI": master.uri, "ROS_LOG_DIR": str(tmp_path / "logs")}
    node = processes.run(sys.executable, str(script), environment=variables)
    lines = (tmp_path / "logs" / "node.log").read_text().splitlines()
    assert [line.split(": ")[-1] for line in lines if "[mine]" in line or "[rosout]" in line] == [
        "own words", "to all",
    ]  # fmt: skip
    assert [line.split(": ")[-1] for line in node.stdout] == ["to all"]


CONFIG = """
[loggers]
keys=root,rosout
[handlers]
keys=console,file
[formatters]
keys=plain
[logger_root]
level=INFO
handlers=file
[logger_rosout]
level=WARNING
handlers=console
qualname=rosout
[handler_console]
class=rosgraph.roslogging.RosStreamHandler
args=(False,)
[handler_file]
class=FileHandler
formatter=plain
args=(os.environ['ROS_LOG_FILENAME'],)
[formatter_plain]
format=%(name)s says %(message)s
"""


def test_a_custom_logging_configuration_is_used(processes: Processes, tmp_path: Path, master: Master) -> None:
    (tmp_path / "log.conf").write_text(CONFIG)
    script = tmp_path / "node.py"
    script.write_text('import rospy\nrospy.init_node("node")\nrospy.loginfo("low")\nrospy.logwarn("high")\n')
    variables = {
        "ROS_MASTER_URI": master.uri, "ROS_LOG_DIR": str(tmp_path / "logs"),
        "ROS_PYTHON_LOG_CONFIG_FILE": str(tmp_path / "log.conf"), "ROSCONSOLE_FORMAT": "${node} ${message}",
    }  # fmt: skip
    node = processes.run(sys.executable, str(script), environment=variables)
    assert node.output.split() == ["/node", "high"]
    assert "rosout says high" in (tmp_path / "logs" / "node.log").read_text()


# The managers in `rospy.impl.registration`: topics and services of a running node.


PROGRAM = """
import json, rospy
import rospy.impl.registration as registration
from std_msgs.msg import String
from std_srvs.srv import Empty

heard = []

class Listener(registration.RegistrationListener):
    def reg_added(self, name, kind, reg_type):
        heard.append(["added", name, kind.partition(":")[0], reg_type])

    def reg_removed(self, name, kind, reg_type):
        heard.append(["removed", name, kind.partition(":")[0], reg_type])

registration.get_registration_listeners().add_listener(Listener())
rospy.init_node("managed", disable_rosout=True)
heard.clear()
topics, services = registration.get_topic_manager(), registration.get_service_manager()
publisher = rospy.Publisher("out", String, queue_size=1)
subscriber = rospy.Subscriber("in", String)
service = rospy.Service("serve", Empty, lambda request: [])
found = {
    "publications": topics.get_publications(),
    "subscriptions": topics.get_subscriptions(),
    "topics": sorted(topics.get_topics()),
    "impl is shared": topics.get_publisher_impl("/out") is publisher.impl,
    "subscribed impl is shared": topics.get_impl("sub", "/in") is subscriber.impl,
    "has": [topics.has_publication("/out"), topics.has_subscription("/out")],
    "services": [name for name, _ in services.get_services() if name == "/serve"],
    "service": services.get_service("/serve") is service,
    "init": rospy.client._init_node_args[0],
}
acquired = topics.acquire_impl("pub", "/acquired", String)
found["acquired"] = topics.get_topics() == {"/out", "/in", "/acquired"} and acquired.type
topics.release_impl("pub", "/acquired")
found["released"] = topics.has_publication("/acquired")
publisher.unregister()
service.shutdown()
found["left"] = [topics.get_publications(), services.get_service("/serve")]
found["heard"] = heard
print(json.dumps(found))
"""


def test_the_managers_list_the_topics_and_services_of_the_node(processes: Processes, master: Master) -> None:
    ran = processes.run(sys.executable, "-c", PROGRAM, environment={"ROS_MASTER_URI": master.uri})
    assert ran.returncode == 0, ran.output
    assert json.loads(ran.stdout[-1]) == {
        "publications": [["/out", "std_msgs/String"]],
        "subscriptions": [["/in", "std_msgs/String"]],
        "topics": ["/in", "/out"],
        "impl is shared": True,
        "subscribed impl is shared": True,
        "has": [True, False],
        "services": ["/serve"],
        "service": True,
        "init": "managed",
        "acquired": "std_msgs/String",
        "released": False,
        "left": [[], None],
        "heard": [
            ["added", "/out", "std_msgs/String", "pub"], ["added", "/in", "std_msgs/String", "sub"],
            ["added", "/serve", "rosrpc", "srv"], ["added", "/acquired", "std_msgs/String", "pub"],
            ["removed", "/acquired", "std_msgs/String", "pub"], ["removed", "/out", "std_msgs/String", "pub"],
            ["removed", "/serve", "rosrpc", "srv"],
        ],
    }  # fmt: skip


# camera_info_manager in a camera driver: its service sets the calibration.


CALIBRATED_PROGRAM = """
import rospy
from camera_info_manager import CameraInfoManager
from sensor_msgs.srv import SetCameraInfo

rospy.init_node("driver")
manager = CameraInfoManager("left", "file://${ROS_HOME}/${NAME}.yaml", "stereo/left")
manager.loadCameraInfo()
print(manager.isCalibrated())
service = rospy.ServiceProxy("/stereo/left/set_camera_info", SetCameraInfo)
service.wait_for_service(30)
request = SetCameraInfo._request_class()
request.camera_info.width = 640
request.camera_info.K = [5.0] * 9
print(service(request))
print(manager.isCalibrated(), manager.getCameraInfo().width)
"""


def test_the_service_saves_a_calibration(processes: Processes, tmp_path: Path, master: Master) -> None:
    environment = {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path)}
    ran = processes.run(sys.executable, "-c", CALIBRATED_PROGRAM, environment=environment)

    assert ran.returncode == 0, ran.output
    assert [line for line in ran.stdout if "[INFO]" not in line] == [
        *("False", "success: True", "status_message: ''", "True 640")
    ], ran.output
    assert "camera_name: left" in (tmp_path / "left.yaml").read_text()


# Libraries on top of rospy in a node, one script each, in its own process.


LIBRARY_HEAD = """
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

print(dynparam("list"), dynparam("set", "node", "gain", "-25e-1"))
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
                "1.0 4.0 [-1, 1, 1]", "False", "(0, '/node', '') (0, '', '')", "(0, '', '') (0, '', '')",
                "['\"on\":', 'true', 'gain:', '-5.0']",
                "(1, '', \"error updating parameters: don't know parameter: nothing\")",
                "(0, '', '') -5.0 True",
            ],
            id="parameters",
        ),
        pytest.param(
            ACTIONS,
            [
                "True True", "those who wait go on: True 5", "done stays done: True 2", "replaced: PREEMPTED",
                "the new one: True True", "cancelled before: RECALLED []",
                "of another type: ['False', 'False'] 0 False", "lost with its server: True True",
                "Type is not an action spec: <",
            ],
            id="goals",
        ),
    ],
)  # fmt: skip
def test_a_script_prints(script, expected: list[str], processes: Processes, tmp_path, master: Master) -> None:
    file = tmp_path / "script.py"
    file.write_text(LIBRARY_HEAD + script)
    environment = {"ROS_MASTER_URI": master.uri, "ROS_HOME": str(tmp_path)}
    ended = processes.run(sys.executable, file, timeout_s=120.0, environment=environment)

    assert [line for line in ended.stdout if not line.startswith("[") or line in expected] == expected, (
        ended.output
    )


def test_topics_are_synchronized(processes: Processes, tmp_path: Path, master: Master) -> None:
    test_a_script_prints(SYNCHRONIZED, ["[(4, 5, 'more')] image /image 1"], processes, tmp_path, master)
