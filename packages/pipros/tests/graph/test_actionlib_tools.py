"""axclient.py and axserver.py, on terminals and in scripts."""

import os
import select
from typing import Any

import pytest

from actionlib import TerminalState
from actionlib_tools import axclient
from actionlib_tools.dynamic_action import DynamicAction
from actionlib_tools.library import yaml_msg_str, yaml_msgs_str
from tests.support.environments import file_of_tests
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
