"""Nodes, services and commands as in a browser tab: processes without threads, whose streams a hub passes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.support.tab_hub import TabHub, TabProcess
from tests.support.tab_programs import BUSY, CLIENT, SERVER, TALKER
from tests.support.waiting import wait_until


@pytest.fixture
def tab(tmp_path: Path) -> Iterator[TabHub]:
    with TabHub(tmp_path) as hub:
        core = hub.run("roscore")
        wait_for_output(core, "started core service [/rosout]")
        yield hub


def wait_for_output(process: TabProcess, text: str) -> None:
    wait_until(lambda: text in process.output or not process.is_running, 60)
    assert text in process.output, process.output


def output_of(process: TabProcess) -> str:
    assert process.wait() == 0, process.output
    return process.output


def test_nodes_talk_call_each_other_and_end(tab: TabHub) -> None:
    talker, server = tab.start("talker", TALKER), tab.start("server", SERVER)
    assert "the client is done" in output_of(tab.start("client", CLIENT))
    assert "tick" in server.output
    talker.interrupt()
    assert output_of(talker).endswith("the hook ran\nthe talker ended\n")
    assert "[INFO]" in talker.output
    assert output_of(tab.run("rosnode", "kill", "server")) == "killing /server\nkilled\n"
    assert output_of(server).endswith("the server ended\n")
    assert output_of(tab.run("rosnode", "list")) == "/rosout\n"


def test_commands_print_the_same_as_on_a_machine(tab: TabHub) -> None:
    talker = tab.start("talker", TALKER)
    wait_for_output(talker, "the talker talks")
    assert output_of(tab.run("rostopic", "list")) == "/chatter\n/latched\n/rosout\n/rosout_agg\n"
    assert output_of(tab.run("rostopic", "echo", "-n1", "/latched")) == 'data: "kept"\n---\n'
    assert output_of(tab.run("rosparam", "get", "/settings/rate")) == "20\n"
    assert "Type: std_msgs/String\n" in output_of(tab.run("rostopic", "info", "/chatter"))
    assert " * /talker/get_loggers\n" in output_of(tab.run("rosnode", "info", "/talker"))
    assert "level" in output_of(tab.run("rosservice", "call", "/talker/get_loggers"))
    broken = tab.run("python3", "-c", "import sys; print(sys.argv); 1 / 0", "word")
    assert broken.wait() == 1
    assert broken.output.splitlines() == [
        "['-c', 'word']", "Traceback (most recent call last):", '  File "<string>", line 1, in <module>',
        "ZeroDivisionError: division by zero",
    ]  # fmt: skip
    shown = tab.run("rosmsg", "show")
    assert shown.wait() == 2
    assert "rosmsg: error: you must specify" in shown.output
    missing = tab.run("rosfoo")
    assert (missing.wait(), missing.output) == (127, "rosfoo: command not found\n")
    refused = tab.run(__file__)
    assert (refused.wait(), "Permission denied. Make it a program: chmod +x /" in refused.output) == (
        126,
        True,
    )


def test_a_loop_that_never_sleeps_gets_messages(tab: TabHub) -> None:
    tab.start("talker", TALKER)
    source = """
import rospy
from std_msgs.msg import String

rospy.init_node("listener")
heard = []
rospy.Subscriber("latched", String, heard.append)
while not rospy.is_shutdown():
    if not heard:
        continue  # as in the tutorials, which look up transforms
    print(heard[0].data)
    break
"""
    assert output_of(tab.start("listener", source)) == "kept\n"


def test_programs_read_single_keys_and_no_lines(tab: TabHub) -> None:
    teleop = tab.run("rosrun", "turtlesim", "turtle_teleop_key")
    wait_until(lambda: teleop.output.endswith("'q' to quit.\n\033]133;K;\007"), 60)
    teleop.type(keys="\033[Aq")
    assert teleop.wait() == 0
    asking = tab.start("asking", "input('name? ')\n")
    assert asking.wait() == 1
    assert 'asking.py", line 1, in <module>' in asking.output


def test_a_node_follows_simulated_time(tab: TabHub) -> None:
    source = """
import rospy
from rosgraph_msgs.msg import Clock

rospy.set_param("/use_sim_time", True)
rospy.init_node("sleeper")
ticks = []
rospy.Timer(rospy.Duration(1), lambda event: ticks.append(event.current_real.to_sec()))
clock = rospy.Publisher("/clock", Clock, queue_size=10)
time = [100.0]

def advance():
    time[0] += 0.5
    clock.publish(rospy.Time.from_sec(time[0]))
    return 0.01

from pipros.basics import one_thread
one_thread.turns.repeat(advance)
rospy.sleep(5)
assert rospy.get_time() >= 105, rospy.get_time()
assert len(ticks) >= 3, ticks
print("slept")
"""
    assert output_of(tab.start("sleeper", source)).endswith("slept\n")


def test_an_interrupt_ends_a_program_that_computes_only_the_second_time(tab: TabHub) -> None:
    busy = tab.start("busy", BUSY)
    wait_for_output(busy, "computing")
    busy.interrupt()
    assert output_of(tab.run("rosnode", "list")) == "/busy\n/rosout\n"
    busy.interrupt()
    assert busy.wait() != 0


WAITS: Final = {
    "sleep": "rospy.sleep(1000)", "time": "time.sleep(1000)", "event": "threading.Event().wait()",
    "loop": "while True: rospy.sleep(1000)",
    "rate": "while not rospy.is_shutdown(): rospy.Rate(0.01).sleep()",
    "message": "rospy.wait_for_message('/silent', String)", "service": "rospy.wait_for_service('/nobody')",
    "call": "rospy.ServiceProxy('~slow', Empty)()",
}  # fmt: skip
"""What a callback waits for."""


WAITING: Final = """
import threading, time
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty

def wait(message):
    print("waits", flush=True)
    WAIT

rospy.init_node("NAME")
rospy.on_shutdown(lambda: print("the hook ran"))
rospy.Service("~slow", Empty, lambda _: time.sleep(1000))
rospy.Subscriber("~own", String, wait)
publisher = rospy.Publisher("~own", String, queue_size=1, latch=True)
publisher.publish("once")
rospy.spin()
print("over")
"""


@pytest.mark.parametrize("name", WAITS)
def test_ctrl_c_ends_a_node_whose_callback_waits(tab: TabHub, name: str) -> None:
    node = tab.start(name, WAITING.replace("WAIT", WAITS[name]).replace("NAME", name))
    wait_for_output(node, "waits")
    node.interrupt()
    assert output_of(node).endswith("the hook ran\nover\n")


def test_a_callback_that_begins_while_its_node_ends_delays_it_little(tab: TabHub) -> None:
    source = """
import rospy
from std_msgs.msg import String

def wait(message):
    print("waits", flush=True)
    rospy.sleep(1000)

def hook():
    publisher.publish("late")
    rospy.sleep(1)
    print("the hook ran")

rospy.init_node("late")
rospy.on_shutdown(hook)
rospy.Subscriber("~own", String, wait)
publisher = rospy.Publisher("~own", String, queue_size=1)
while publisher.get_num_connections() == 0:
    rospy.sleep(0.1)
"""
    assert output_of(tab.start("late", source)) == "waits\nthe hook ran\n"


def test_an_error_in_a_program_is_shown_with_its_line(tab: TabHub) -> None:
    broken = tab.start("broken", "import rospy\nprint(1 +)\n")
    assert broken.wait() == 1
    assert 'broken.py", line 2' in broken.output
    assert "SyntaxError" in broken.output


LAUNCH = """<launch>
  <node pkg="rospy_tutorials" type="talker.py" name="talker" output="screen"/>
  <node pkg="rospy_tutorials" type="listener.py" name="listener"/>
</launch>
"""


def test_a_terminal_launches_nodes_and_ends_them(tab: TabHub, tmp_path: Path) -> None:
    (tmp_path / "two.launch").write_text(LAUNCH)
    terminal = tab.run("bash")
    terminal.type(line="mkdir a && cd a; pwd")
    wait_for_output(terminal, f"{tmp_path}/a\n")
    terminal.type(line="roslaunch ../two.launch")
    wait_for_output(terminal, "hello world")
    terminal.type(complete="rosno")
    wait_until(lambda: "/listener\n/rosout\n/talker\n" in output_of(tab.run("rosnode", "list")))
    terminal.interrupt()
    wait_for_output(terminal, "... shutting down processing monitor complete")
    wait_for_output(terminal, '"completed": "rosnode "')
    terminal.type(line="exit")
    assert terminal.wait() == 0


def test_rosrun_replaces_itself_by_a_program_of_a_package(tab: TabHub) -> None:
    server = tab.run("rosrun", "rospy_tutorials", "add_two_ints_server")
    client = tab.run("rosrun", "rospy_tutorials", "add_two_ints_client", "2", "3")
    assert "5" in output_of(client).splitlines()[-1]
    server.interrupt()
    assert server.wait() == 0, server.output


def test_goals_of_actions_are_executed(tab: TabHub) -> None:
    tab.start(
        "counter",
        """
import actionlib, rospy
from actionlib_tutorials.msg import FibonacciAction, FibonacciResult

def execute(goal):
    rospy.sleep(0.1)
    server.set_succeeded(FibonacciResult(sequence=[goal.order]))

rospy.init_node("counter")
server = actionlib.SimpleActionServer("count", FibonacciAction, execute, False)
server.start()
rospy.spin()
""",
    )
    client = tab.start(
        "asker",
        """
import actionlib, rospy
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal

rospy.init_node("asker")
client = actionlib.SimpleActionClient("count", FibonacciAction)
client.wait_for_server()
client.send_goal(FibonacciGoal(order=7))
client.wait_for_result()
print(client.get_result().sequence)
""",
    )
    assert output_of(client) == "(7,)\n"
