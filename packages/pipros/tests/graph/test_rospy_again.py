"""A process that starts a second node after the first has shut down, as notebooks and tests do."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.processes import Process, Processes

HEAD = """
import functools, os, signal, sys
import rospy, rospy.client, rospy.core
from pipros.node.timings import NodeTimings
from rospy import node_start
from std_msgs.msg import String
from std_srvs.srv import Trigger
patient = NodeTimings(unregister_s=30)  # the master, in the process of the test, may be busy
node_start.Node = functools.partial(node_start.Node, timings=patient)

def begin_anew(name, **more):
    rospy.client._init_node_args = None
    rospy.core._shutdown_flag = rospy.core._in_shutdown = False
    rospy.init_node(name, **more)

def talk_to_oneself():
    publisher = rospy.Publisher('said', String, queue_size=1, latch=True)
    publisher.publish('by ' + rospy.get_name())
    print('heard', rospy.wait_for_message('said', String, 20).data)
    rospy.Service('~ask', Trigger, lambda _: (True, rospy.get_name()))
    print('answered', rospy.ServiceProxy('~ask', Trigger)().message)

def registered():
    state = rospy.get_master().getSystemState()[2]
    return sorted({node for part in state for _, nodes in part for node in nodes})
"""

FIRST = """
rospy.init_node('first')
rospy.on_shutdown(lambda: print('hook of the first'))
talk_to_oneself()
"""

SECOND = """
talk_to_oneself()
rospy.loginfo('said once')
print('registered', registered())
rospy.spin()
print('ended', registered())
"""


def start(processes: Processes, tmp_path: Path, uri: str, code: str) -> Process:
    script = tmp_path / "node.py"
    script.write_text(HEAD + code)
    return processes.start(sys.executable, "-u", script, environment={"ROS_MASTER_URI": uri})


@pytest.mark.parametrize(
    "between",
    [
        "rospy.signal_shutdown('enough')\nbegin_anew('second')",
        "rospy.signal_shutdown('enough')\nbegin_anew('second', disable_signals=True)",
        "os.kill(os.getpid(), signal.SIGINT)\nrospy.spin()\nbegin_anew('second')",
        "rospy.client._init_node_args = None\nrospy.init_node('second')",
    ],
)
def test_a_second_node_is_fully_functional(
    processes: Processes, tmp_path: Path, master: Master, between: str
) -> None:
    node = start(processes, tmp_path, master.uri, FIRST + between + SECOND)
    node.wait_for("^registered")
    node.press_ctrl_c()
    assert node.wait() == 0
    assert [line for line in node.stdout if not line.startswith("[")] == [
        "heard by /first",
        "answered /first",
        "hook of the first",
        "heard by /second",
        "answered /second",
        "registered ['/second']",
        "ended []",
    ]
    assert len([line for line in node.stdout if "said once" in line]) == 1


def test_objects_of_the_first_node_are_refused_with_an_explanation(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    code = """
rospy.init_node('first')
publisher = rospy.Publisher('said', String, queue_size=1)
subscriber = rospy.Subscriber('said', String)
rospy.signal_shutdown('enough')
publisher.publish('not received')
begin_anew('second')
try:
    publisher.publish('x')
except rospy.ROSException as error:
    print(error)
publisher.unregister()
subscriber.unregister()
"""
    node = start(processes, tmp_path, master.uri, code)
    assert node.wait() == 0, node.output
    assert node.stdout == ["publish() to a closed topic"]


def test_a_forked_child_may_start_its_own_node(processes: Processes, tmp_path: Path, master: Master) -> None:
    code = """
rospy.init_node('parent')
child = os.fork()
if not child:
    rospy.client._init_node_args = None
    rospy.init_node('child')
    talk_to_oneself()
    print('registered', registered())
    sys.exit()
assert os.waitpid(child, 0)[1] == 0
print('is shut down', rospy.is_shutdown())
print('registered', registered())
talk_to_oneself()
"""
    node = start(processes, tmp_path, master.uri, code)
    assert node.wait() == 0, node.output
    assert node.stdout == [
        "heard by /child",
        "answered /child",
        "registered ['/child', '/parent']",
        "is shut down False",
        "registered ['/parent']",
        "heard by /parent",
        "answered /parent",
    ]


def test_a_child_that_is_forked_while_a_thread_imports_may_use_topics(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    code = """
import importlib.util, threading, time
from pipros.node import node

class SlowImport:
    def find_spec(self, name, path, target=None):
        if name == 'pipros.node.publisher_connector':
            sys.meta_path.remove(self)
            spec = importlib.util.find_spec(name)
            run = spec.loader.exec_module
            spec.loader.exec_module = lambda module: (begun.set(), time.sleep(0.5), run(module))
            return spec

begun = threading.Event()
sys.meta_path.insert(0, SlowImport())
node._LOAD_LINKS_S = 1.0  # so that `init_node` has returned
rospy.init_node('parent')
assert begun.wait(10)
child = os.fork()
if not child:
    from pipros.node.subscriber import Subscriber
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
"""
    node = start(processes, tmp_path, master.uri, code)
    assert node.wait() == 0, node.output


def test_a_flag_that_a_program_sets_ends_its_loops(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    code = """
rospy.init_node('first')
rospy.core._shutdown_flag = True
while not rospy.is_shutdown():
    pass
rospy.core._shutdown_flag = False
print(rospy.is_shutdown(), rospy.get_name())
talk_to_oneself()
"""
    node = start(processes, tmp_path, master.uri, code)
    assert node.wait() == 0, node.output
    assert node.stdout == ["False /first", "heard by /first", "answered /first"]


def test_ctrl_c_ends_a_second_node_that_was_made_in_another_thread(
    processes: Processes, tmp_path: Path, master: Master
) -> None:
    code = """
import threading
rospy.init_node('first')
rospy.signal_shutdown('enough')
thread = threading.Thread(target=begin_anew, args=('second',), kwargs={'disable_signals': True})
thread.start()
thread.join()
print('up')
rospy.spin()
print('ended', registered())
"""
    node = start(processes, tmp_path, master.uri, code)
    node.wait_for("^up$")
    node.send_signal(signal.SIGINT)
    assert node.wait() == 0, node.output
    assert node.stdout[-1] == "ended []"
