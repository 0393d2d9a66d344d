"""Ctrl-C at any moment: one is enough, and no process or registration is left."""

import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime, timezone
from pathlib import Path

import pytest
from actionlib_msgs.msg import GoalID
from std_msgs.msg import String

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from tests.support.environments import REPOSITORY
from tests.support.every_program import EVERY, MOMENTS_MS, NUMBERS, WAITS_MS, end_program
from tests.support.nodes import MakeNode
from tests.support.ports import ClaimedPort
from tests.support.processes import Process, Processes
from tests.support.ros import RosSystem
from tests.support.slaves import SilentSlave
from tests.support.waiting import wait_until

# Ctrl-C at any moment of the start: one is enough, and no process or registration is left. A signal that
# arrives just before the main thread begins to wait is handled only when that wait ends, so no wait of the
# main thread may be endless. The moments below are spread over the start, and the last of them are those in
# which the waits begin. The tests of byte codes below test these in detail.


LAUNCH = ("roslaunch", "composiv_tryouts", "composiv_tryout.launch")
MOMENTS = (
    "... logging to", "Press Ctrl-C to interrupt", "started roslaunch server", "auto-starting new master",
    "setting /run_id", "started core service", "process\\[talker-2\\]", "process\\[listener-3\\]",
    "SyntaxWarning",
)  # fmt: skip
ENDS_WITHIN_S = 30.0
"""Half a second is promised; this test looks for waits that never end."""


def end(ros: RosSystem, launch: Process) -> None:
    launch.press_ctrl_c()
    code = launch.wait(ENDS_WITHIN_S)
    assert code == 0, launch.output
    assert "escalating" not in launch.output
    ros.pipros.processes.assert_nothing_left()


@pytest.mark.parametrize("moment", MOMENTS)
def test_roslaunch_ends_at_this_moment_of_its_start(ros: RosSystem, moment: str) -> None:
    launch = ros.pipros.start(*LAUNCH)
    launch.wait_for(moment)

    end(ros, launch)


@pytest.mark.parametrize("attempt", range(6))
def test_roslaunch_ends_when_its_nodes_begin_to_wait(ros: RosSystem, attempt: int) -> None:
    launch = ros.pipros.start(*LAUNCH)
    wait_until(
        lambda: ros.publishers("/battery_topic") and ros.subscribers("/battery_topic"), 60,
        what=lambda: f"talker and listener are not there:\n{launch.output}",
    )  # fmt: skip

    end(ros, launch)


@pytest.mark.parametrize("attempt", range(6))
def test_a_listener_ends_when_it_begins_to_wait(ros: RosSystem, attempt: int) -> None:
    ros.pipros.start_master()
    listener = ros.pipros.start("rosrun", "composiv_tryouts", "composiv_listener.py")
    ros.wait_for_subscriber("/battery_topic", 60)

    listener.press_ctrl_c()

    assert listener.wait(ENDS_WITHIN_S) == 0, listener.output


# One Ctrl-C is enough, even between two bytecode instructions of a wait; see `tests.chaos.interrupt_at`.


CODE_MOMENTS = (*range(30, 400, 40), *range(1000, 1250, 50))
"""Spread over the start of the node and its wait. A wait with fewer byte codes gets SIGINT while it lasts."""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the runs are forked children")
@pytest.mark.parametrize("what", ["command", "node"])
def test_ctrl_c_between_two_byte_codes_is_not_lost(processes, master, make_node: MakeNode, what: str) -> None:
    make_node("talker").advertise("/chatter", String, latch=True).publish(String("x"))
    runs = processes.run(
        sys.executable, "-m", "tests.chaos.interrupt_at", what, *map(str, CODE_MOMENTS), cwd=REPOSITORY,
        environment={"ROS_MASTER_URI": master.uri}, timeout_s=300,
    )  # fmt: skip
    assert "done" in runs.stdout, runs.output
    assert "was lost" not in runs.output
    assert "RuntimeError" not in runs.output  # a lock that is released twice


# SIGINT and SIGTERM end an action server with a running `execute_cb`, and its shutdown hooks run.


SERVER = """
import sys, time
import actionlib, rospy
from actionlib.msg import TestAction

def execute(goal):
    print('working', flush=True)
    {work}

rospy.init_node('server')
rospy.on_shutdown(lambda: print('the hook ran', flush=True))
server = actionlib.SimpleActionServer('go', TestAction, execute, auto_start=False)
server.start()
print('ready', flush=True)
{main}
"""
BLOCKS = "time.sleep(100)"
NOTICES = """while not rospy.is_shutdown():
        time.sleep(0.01)
    print('the robot is parked', flush=True)"""


def start_server(processes: Processes, tmp_path: Path, master: Master, work: str, main: str) -> Process:
    script = tmp_path / "server.py"
    script.write_text(SERVER.format(work=work, main=main))
    server = processes.start(sys.executable, script, environment={"ROS_MASTER_URI": master.uri})
    server.wait_for("ready")
    return server


def send_goal(node: Node) -> None:
    goal_class = load_message_class("actionlib/TestActionGoal")
    publisher = node.advertise("/go/goal", goal_class)
    wait_until(lambda: publisher.connection_count > 0)
    publisher.publish(goal_class(goal_id=GoalID(id="first")))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_server_whose_callback_blocks(processes, tmp_path, master, number) -> None:
    server = start_server(processes, tmp_path, master, BLOCKS, "rospy.spin()")
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(number)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the hook ran" in server.output


def test_a_callback_that_notices_the_shutdown_finishes_its_work(processes, tmp_path, master: Master) -> None:
    patient = "actionlib.simple_action_server._GRACE_S = 60.0\nrospy.spin()"  # for a busy machine
    server = start_server(processes, tmp_path, master, NOTICES, patient)
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(signal.SIGINT)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the robot is parked" in server.output


def test_a_server_without_spin_serves_until_a_signal_as_in_noetic(processes, tmp_path, master) -> None:
    server = start_server(processes, tmp_path, master, BLOCKS, "")
    with Node("client", environment=Environment(master_uri=master.uri)) as node:
        send_goal(node)
        server.wait_for("working")
        server.send_signal(signal.SIGINT)

        assert server.wait(ENDS_WITHIN_S) == 0
    assert "the hook ran" in server.output


# Ctrl-C ends tools at once while they wait for nodes that accept connections and never respond.


AT_ONCE_S = 30.0
"""Half a second is promised; every look at a silent node takes 100 s here."""

PATIENT = """
import os, sys
from pipros.net.rpc_client import RpcClient
make = RpcClient.__init__
def make_patient(client, uri, *, timeout_s=None, **more):
    make(client, uri, timeout_s=100.0, **more)
    os.write(1, f'asks {uri}\\n'.encode())  # a daemon thread in print can abort the end of the interpreter
RpcClient.__init__ = make_patient
"""

TOOLS = {
    "rosnode ping -a": ["pipros_tools.cli.rosnode", "ping", "-a"],
    "rosnode cleanup": ["pipros_tools.cli.rosnode", "cleanup"],
    "roswtf": ["pipros_tools.cli.roswtf", "--no-plugins"],
    "pipros doctor": ["pipros_tools.cli.doctor", "--timeout", "100"],
}


@pytest.fixture
def silent(master: Master) -> Iterator[SilentSlave]:
    """A node's address that is registered under five names."""
    slave = SilentSlave()
    for number in range(5):
        with closing(MasterClient(master.uri, f"/silent_{number}")) as client:
            client.register_publisher("/chat", "std_msgs/String", slave.api)
    yield slave
    slave.stop()


def start(processes: Processes, master: Master, tool: str) -> Process:
    module, *arguments = TOOLS[tool]
    code = f"{PATIENT}from {module} import main\nsys.exit(main({arguments}))"
    return processes.start(sys.executable, "-c", code, environment={"ROS_MASTER_URI": master.uri})


@pytest.mark.parametrize("tool", TOOLS)
def test_ctrl_c_ends_a_tool_that_waits_for_silent_nodes(processes, master, silent, tool: str) -> None:
    process = start(processes, master, tool)
    process.wait_for(f"asks {silent.api}")  # the master has connected to it, too
    began = time.monotonic()
    process.press_ctrl_c(code=0)
    assert time.monotonic() - began < AT_ONCE_S, process.output
    assert "Traceback" not in process.output
    assert "Unable to contact" not in process.output


# A signal ends every program at any moment of its start, also while its master accepts and is silent.
#
# `script/long signals` does this at ten moments, and prints the times, of which half a second is promised.
# Here each program is ended when it waits, and at one moment before, which the seed chooses
# (`PIPROS_TEST_SEED`; default: the date).


SEED = os.environ.get("PIPROS_TEST_SEED") or datetime.now(timezone.utc).date().isoformat()


@pytest.mark.parametrize("command", EVERY)
def test_a_signal_ends_this_program(command: str, tmp_path: Path) -> None:
    chance = random.Random(f"{SEED} {command}")  # noqa: S311
    port = ClaimedPort()
    try:
        for moment in (chance.choice(MOMENTS_MS[:-1]), WAITS_MS):
            ended = end_program(command, moment, chance.choice(NUMBERS), tmp_path, port=port.number)
            assert not ended.complaint, f"seed {SEED}: {ended.complaint}"
    finally:
        port.release()


# Python 3.14 ends by SIGINT after any KeyboardInterrupt, and `ROSInterruptException` is one.
INTERRUPTED_START = 1 if sys.version_info < (3, 14) else -signal.SIGINT


@pytest.mark.parametrize("node", ["fibonacci_server", "averaging_server"])
def test_ctrl_c_in_init_node_prints_no_traceback(ros: RosSystem, node: str) -> None:
    silent = SilentSlave()
    for uri in (ros.master_uri, silent.api):  # no master, and one that does not respond
        program = ros.pipros.start("rosrun", "actionlib_tutorials", node, ROS_MASTER_URI=uri)
        if uri == silent.api:
            wait_until(lambda: silent.connections)
        else:
            program.wait_for("Unable to register with master node")
        program.press_ctrl_c()

        program.check(INTERRUPTED_START)
    silent.stop()


def waiting_launch(ros: RosSystem, master: SilentSlave) -> Process:
    file = ros.home / "node.launch"
    file.write_text("<launch/>")
    return ros.pipros.start("roslaunch", "--wait", str(file), ROS_MASTER_URI=master.api)


def test_roslaunch_that_waits_says_that_the_port_is_in_use(ros: RosSystem) -> None:
    master = SilentSlave()
    launch = waiting_launch(ros, master)
    launch.wait_for("the port of ROS_MASTER_URI .* is in use, but no master responds there")
    launch.press_ctrl_c(code=130)
    assert "auto-starting new master" not in launch.output
    assert "Traceback" not in launch.output
    master.stop()


def test_ctrl_c_ends_roslaunch_that_waits_for_a_master(ros: RosSystem) -> None:
    (ros.home / "node.launch").write_text("<launch/>")
    launch = ros.pipros.start("roslaunch", "--wait", str(ros.home / "node.launch"))
    launch.wait_for("roscore/master is not yet running")
    launch.press_ctrl_c(code=130)
    assert "auto-starting new master" not in launch.output
