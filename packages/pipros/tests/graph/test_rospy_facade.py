"""Parts of rospy that need a node, one script each, in its own process."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from tests.support.processes import Processes

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
                "[True, True, True, True, True] False",
                "throttle [True, False, False]",
                "throttle_identical [True, False, False]",
                "once [True, False, False]",
            ],
        ),
    ],
    ids=[
        "numpy_msg",
        "SubscribeListener",
        "statistics",
        "rosout",
        "nothing is left of a wait",
        "throttled by durations",
        "logging says whether it logged",
    ],
)
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


def test_all_loggers_of_a_process_write_to_its_log_file_as_in_noetic(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    script = tmp_path / "node.py"
    script.write_text(
        'import logging, rospy\nrospy.init_node("node")\nlogging.getLogger("mine").info("own words")\n'
        'rospy.loginfo("to all")\nrospy.logdebug("not logged")\n'
    )
    variables = {"ROS_MASTER_URI": master.uri, "ROS_LOG_DIR": str(tmp_path / "logs")}
    node = processes.run(sys.executable, str(script), environment=variables)
    lines = (tmp_path / "logs" / "node.log").read_text().splitlines()
    assert [line.split(": ")[-1] for line in lines if "[mine]" in line or "[rosout]" in line] == [
        "own words",
        "to all",
    ]
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
        "ROS_MASTER_URI": master.uri,
        "ROS_LOG_DIR": str(tmp_path / "logs"),
        "ROS_PYTHON_LOG_CONFIG_FILE": str(tmp_path / "log.conf"),
        "ROSCONSOLE_FORMAT": "${node} ${message}",
    }
    node = processes.run(sys.executable, str(script), environment=variables)
    assert node.output.split() == ["/node", "high"]
    assert "rosout says high" in (tmp_path / "logs" / "node.log").read_text()
