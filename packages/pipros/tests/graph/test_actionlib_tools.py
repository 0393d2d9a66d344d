"""The programs of actionlib_tools and topic_tools."""

import os
import select
from typing import Any

import pytest

from actionlib import TerminalState
from actionlib_tools import axclient
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.library import yaml_msg_str, yaml_msgs_str
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from tests.support.environments import file_of_tests
from tests.support.nodes import wait_until_connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SERVER = file_of_tests("interop/programs/serve_goals.py")


def test_messages_are_made_of_yaml() -> None:
    from actionlib.msg import TestGoal

    assert (yaml_msg_str(TestGoal, "goal: 3").goal, yaml_msg_str(TestGoal, " ").goal) == (3, 0)
    assert [goal.goal for goal in yaml_msgs_str(TestGoal, "[{goal: 1}, {}]")] == [1, 0]
    with pytest.raises(ValueError, match="yaml string does not contain a dictionary"):
        yaml_msg_str(TestGoal, "[1]")
    with pytest.raises(ValueError, match=r"yaml file \[f\] does not contain a list of dictionaries"):
        yaml_msgs_str(TestGoal, "goal: 1", "f")


def test_a_script_sends_a_goal_that_a_script_answers(ros: RosSystem) -> None:
    ros.serve_master()
    (ros.home / "run.sh").write_text(
        "echo 'sequence: [1, 1, 2]' | rosrun actionlib axserver.py /fib actionlib_tutorials/Fibonacci &\n"
        "until rostopic type /fib/goal; do :; done\n"
        "echo 'order: 3' | rosrun actionlib_tools axclient.py /fib; echo ended $?\n"
        "echo 'size: 3' | rosrun actionlib_tools axclient.py /fib; echo ended $?\n"
        "echo 'order: many' | rosrun actionlib_tools axclient.py /fib; echo refused $?\n"
        "kill -INT -$$\nwait\n"
    )
    ran = ros.pipros.start("bash", "-m", ros.home / "run.sh")
    ran.wait_for("ended 2")
    ran.wait_for("refused 2")
    # Standard error and standard output are read by different threads.
    wait_until(lambda: ran.output.count("not a valid actionlib_tutorials/FibonacciGoal") == 2)
    ran.press_ctrl_c()

    assert ran.output.index("  order: 3") < ran.output.index(
        "SUCCEEDED"
    )  # lines of two programs may be mixed
    assert "  sequence: [1, 1, 2]" in ran.stdout
    assert "ended 0" in ran.stdout


@pytest.mark.parametrize("program", ["axclient.py", "axserver.py"])
def test_ctrl_c_ends_the_wait_for_a_pipe(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    reader, writer = os.pipe()
    waiting = ros.pipros.processes.start(
        *("rosrun", "actionlib_tools", program, "/test", "actionlib/TestAction"), stdin=reader
    )
    with os.fdopen(reader), os.fdopen(writer, "w") as pipe:
        print("a line", file=pipe, flush=True)
        wait_until(lambda: not select.select([reader], [], [], 0)[0], what="the program to read")
        waiting.press_ctrl_c(code=130)


def test_goals_are_set_edited_sent_and_cancelled_on_a_terminal(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("python3", SERVER)
    (ros.home / "editor").write_text("#!/bin/sh\necho 'goal: 7' >$1\n")
    (ros.home / "editor").chmod(0o755)
    ros.pipros.environment["EDITOR"] = str(ros.home / "editor")
    ros.wait_for_subscriber("/simple/goal")
    terminal = ros.pipros.open_terminal()

    def answer(line: str, expected: str) -> None:
        terminal.wait_for("axclient> $")
        terminal.answer(line)
        terminal.wait_for(expected)

    terminal.type("rosrun actionlib_tools axclient.py /simple")
    answer("set goal: many", "not a valid actionlib/TestGoal")
    answer("set goal: 5", "  goal: 5")
    answer("send", "SUCCEEDED: reached")
    answer("edit", "  goal: 7")
    answer("help", "Commands: edit")
    answer("set goal: 100", "  goal: 100")
    answer("send", "feedback:")
    terminal.press_ctrl_c()
    terminal.wait_for("PREEMPTED: asked to end")
    terminal.wait_for("axclient> $")
    terminal.answer("quit")
    assert terminal.wait_for_prompt() == 0


def test_goals_are_answered_on_a_terminal_until_ctrl_c_or_the_end_of_the_node(ros: RosSystem) -> None:
    ros.serve_master()
    terminal = ros.pipros.open_terminal()
    command = "rosrun actionlib_tools axserver.py /test actionlib/Test"

    def answer(line: str, expected: str) -> None:
        terminal.answer(line)
        terminal.wait_for(expected)

    terminal.type(command)
    terminal.wait_for("axserver> $")
    answer("succeed result: 1", "no goal is active")
    (ros.home / "goal.yaml").write_text("goal: 5")
    client = ros.pipros.start("bash", "-c", "rosrun actionlib_tools axclient.py /test <goal.yaml")
    terminal.wait_for("  goal: 5")
    answer("jump", "Commands: feedback")
    answer("feedback feedback: many", "not a valid actionlib/TestFeedback")
    terminal.answer("feedback feedback: 3")
    client.wait_for("  feedback: 3")
    terminal.answer("succeed result: 4")
    client.wait_for("  result: 4")
    assert client.wait() == 0
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 130

    terminal.type(command)
    terminal.wait_for("axserver> $")
    (node,) = [name for name in ros.pipros.run("rosnode", "list").stdout if "axserver" in name]
    ros.pipros.run("rosnode", "kill", node)
    assert terminal.wait_for_prompt() == 0


def test_feedback_that_another_thread_delivers_after_the_result_is_not_shown(monkeypatch, capsys) -> None:
    from actionlib.msg import TestFeedback, TestResult

    class Unordered:
        def __init__(self, *_: Any) -> None: ...

        def send_goal(self, _: Any, on_end: Any, on_active: Any, on_feedback: Any) -> None:
            on_active()
            on_feedback(TestFeedback(1))
            on_end(TerminalState.PREEMPTED, TestResult(2))
            on_feedback(TestFeedback(3))

        def get_goal_status_text(self) -> str:
            return ""

    monkeypatch.setattr(axclient, "SimpleActionClient", Unordered)
    axclient.Client("/test", DynamicAction("actionlib/TestAction")).send()
    assert capsys.readouterr().out.splitlines()[1:] == [
        *("feedback:", "  feedback: 1", "result:", "  result: 2", "PREEMPTED")
    ]


def test_a_missing_action_is_named(ros: RosSystem) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rosrun", "actionlib_tools", "axclient.py", "/nothing")
    ended.check(2, "Is the action server for '/nothing' running?")


# The programs of topic_tools in a launch file, with unknown types, and with wrong expressions.


LAUNCH = """<launch>
  <node pkg="topic_tools" type="relay" name="passing" args="/strange /passed" output="screen">
    <param name="lazy" value="true"/>
  </node>
  <node pkg="topic_tools" type="throttle" name="slow" args="messages /strange 0.0001" output="screen">
    <param name="force_latch" value="true"/>
  </node>
  <node pkg="topic_tools" type="transform" name="wrong" args="/numbers /x std_msgs/Float64 m.nothing"
        output="screen"/>
  <node pkg="topic_tools" type="transform" name="refused" output="screen"
        args="/numbers /x std_msgs/Float64 os.getpid() --import os"/>
</launch>"""


class Strange(AnyMsg):
    """A type that no package defines."""

    _type = "strange_msgs/Thing"
    _md5sum = "0123456789abcdef0123456789abcdef"
    _full_text = "uint8 secret\n"


class Other(Strange):
    _type = "strange_msgs/Other"
    _md5sum = "f" * 32


def test_launched_programs_relay_messages_of_unknown_types(ros: RosSystem) -> None:
    ros.serve_master()
    numbers: Any = load_message_class("std_msgs/Float64")
    launch = ros.home / "tools.launch"
    launch.write_text(LAUNCH)
    got: list[tuple[str, bytes]] = []
    headers: dict[str, Any] = {}
    with ros.node("probe") as node:
        publisher = node.advertise("/strange", Strange, latch=True)
        publisher.publish(Strange(b"\x07"))
        node.advertise("/numbers", numbers, latch=True).publish(numbers(1.0))
        launched = ros.pipros.start("roslaunch", launch)
        for topic in ("/passed", "/strange_throttle"):
            ros.wait_for_publisher(topic)

            def keep(message: AnyMsg, topic: str = topic) -> None:
                headers[topic] = message.header
                got.append((topic, message.body))

            node.subscribe(topic, AnyMsg, keep)
        passed = {("/passed", b"\x07"), ("/strange_throttle", b"\x07")}
        wait_until(lambda: set(got) == passed, 30, lambda: f"{got} {launched.output}")
        header = headers["/strange_throttle"]
        assert (header["type"], header["md5sum"]) == (Strange._type, Strange._md5sum)
        assert (header["message_definition"], header["latching"]) == (Strange._full_text, "1")

        with Node("other", environment=node.environment) as other:
            other.advertise("/strange", Other, latch=True).publish(Other(b"\x08"))
            launched.wait_for(
                r"\[/other\] publishes strange_msgs/Other, which cannot be passed on: /passed is"
            )
            publisher.publish(Strange(b"\x09"))
            wait_until(lambda: ("/passed", b"\x09") in got, 30, lambda: f"{got} {launched.output}")
        assert ("/passed", b"\x08") not in got

        launched.wait_for(r"ERROR.*an expression cannot import os; it can import numpy, math")
        launched.wait_for(r"ERROR.*m\.nothing.*Float64 has no field \[nothing\]")
        launched.press_ctrl_c(code=0)


def test_a_stealthy_relay_sends_nothing_without_a_monitor(ros: RosSystem) -> None:
    """Not even the messages that determine the type, before it checks the monitored topic again."""
    ros.serve_master()
    text: Any = load_message_class("std_msgs/String")
    got: list[str] = []
    with ros.node("probe") as node:
        publisher = node.advertise("/in", text, latch=True)
        publisher.publish(text("secret"))
        node.subscribe("/out", text, lambda message: got.append(message.data))
        relay = ros.pipros.start_node(
            *("topic_tools", "relay", "/in", "/out"),
            *("_stealth:=true", "_monitor_topic:=/watched", "_monitor_rate:=0.001"),
        )
        ros.wait_for_publisher("/out")
        subscription = node.endpoints.subscription("/out")
        wait_until(lambda: subscription.links)
        publisher.publish(text("secret too"))
        relay.press_ctrl_c(code=0)
        wait_until(lambda: not subscription.links)
    assert got == []


def test_a_stealthy_relay_waits_for_the_type_of_its_input(ros: RosSystem) -> None:
    """However often it checks the monitored topic before the first message."""
    ros.serve_master()
    text: Any = load_message_class("std_msgs/String")
    ros.pipros.start_node(
        *("topic_tools", "relay", "/in", "/out"),
        *("_stealth:=true", "_monitor_topic:=/watched", "_monitor_rate:=1000"),
    )
    ros.wait_for_subscriber("/in")
    with ros.node("probe") as node:
        publisher = node.advertise("/in", text, latch=True)
        publisher.publish(text("secret"))
        ros.wait_for_publisher("/out")
        wait_until(lambda: not ros.subscribers("/in"), 30, "no subscriber of /in")


def test_a_throttle_by_wall_clock_needs_no_simulated_time(ros: RosSystem) -> None:
    ros.serve_master()
    text: Any = load_message_class("std_msgs/String")
    got: list[str] = []
    with ros.node("probe") as node:
        node.master.set_param("/use_sim_time", True)
        node.advertise("/in", text, latch=True).publish(text("now"))
        node.subscribe("/in_throttle", text, lambda message: got.append(message.data))
        ros.pipros.start_node(
            *("topic_tools", "throttle", "messages", "/in", "0.001"),
            *("_wall_clock:=true", "_force_latch:=true"),
        )
        wait_until(lambda: got == ["now"], 30, lambda: str(got))


WRONG_ARGUMENTS = {
    "switch_mux // input": 'Base name extracted from "//" is an empty string',
    "switch_mux a! b": "invalid topic name: [a!]", "switch_mux a b!": "invalid topic name: [b!]",
    "relay //": 'Base name extracted from "//" is an empty string', "relay a!": "invalid topic name: [a!]",
    "relay a b!": "invalid topic name: [b!]", "relay /1": "[/1] must end in a valid node name",
    "mux a! b": "invalid topic name: [a!]", "mux a b c!": "invalid topic name: [c!]",
    "mux a //": "invalid topic name: [//]", "demux a b!": "invalid topic name: [b!]",
    "drop a! 1 2": "invalid topic name: [a!]", "drop a 1 2 b!": "invalid topic name: [b!]",
    "throttle messages a! 1": "invalid topic name: [a!]",
    "throttle messages a 1 b!": "invalid topic name: [b!]",
    "throttle bytes a 1 1 b!": "invalid topic name: [b!]", "mux_add m! t": "invalid service name: [m!]",
    "mux_delete m t!": "invalid topic name: [t!]", "mux_select // t": "invalid service name: [//]",
    "mux_list m!": "invalid service name: [m!]",
    "transform a! /b std_msgs/String m": "invalid topic name: [a!]",
    "transform a /b! std_msgs/String m": "invalid topic name: [/b!]",
    "transform a /b std_msgs/Nope m": "ERROR: ", "transform a /b std_msgs/String m(": "ERROR: ",
    "relay_field a[0] /b! std_msgs/String {}": "invalid topic name: [/b!]",
}  # fmt: skip


@pytest.mark.parametrize("command", WRONG_ARGUMENTS)
def test_wrong_arguments_are_refused_without_a_master(ros: RosSystem, command: str) -> None:
    program, *arguments = command.split()
    ran = ros.pipros.processes.run(*ros.pipros.node("topic_tools", program), *arguments)

    ran.check(1, WRONG_ARGUMENTS[command])
    assert len(ran.lines) == 1


def test_a_mux_may_wait_for_its_subscribers_before_the_first_message(ros: RosSystem) -> None:
    ros.serve_master()
    numbers: Any = load_message_class("std_msgs/Float64")
    got: list[float] = []
    waits = ("_wait_publisher_initialization:=true", "_wait_publisher_second:=2")
    with ros.node("probe") as node:
        node.subscribe("/out", numbers, lambda message: got.append(message.data))
        mux = ros.pipros.start_node("topic_tools", "mux", "/out", "/in", *waits)
        ros.wait_for_subscriber("/in")
        publisher = node.advertise("/in", numbers, queue_size=1)
        wait_until_connected(publisher)
        publisher.publish(numbers(1.0))
        wait_until(lambda: got == [1.0])
    mux.press_ctrl_c()
