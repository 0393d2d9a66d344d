"""The tools of `pipros mcp` that act: what the policy names, after a human has approved it, with a log."""

import json
import math
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_libraries.actions.status import Status
from tests.support.assistants import Human, LocalAssistant, Reply
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode
from tests.support.waiting import wait_until

Twist: Any = load_message_class("geometry_msgs/Twist")
String: Any = load_message_class("std_msgs/String")
Joy: Any = load_message_class("sensor_msgs/Joy")
Goal: Any = load_message_class("actionlib_tutorials/FibonacciActionGoal")
Result: Any = load_message_class("actionlib_tutorials/FibonacciActionResult")
GoalID: Any = load_message_class("actionlib_msgs/GoalID")
SetBool: Any = load_service_class("std_srvs/SetBool")
LAUNCH = {"package": "rospy_tutorials", "file": "001_talker_listener/talker_listener.launch"}
POLICY = """\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {linear.x: {range: [-0.3, 0.3], unit: m/s}}
    per_minute: 1000
    time_limit_s: 0.5
  /say: {type: std_msgs/String, fields: {data: {one_of: ["yes", hello]}}, per_minute: 2}
services:
  /motor: {type: std_srvs/SetBool, fields: {data: any}, time_limit_s: 0.5}
actions:
  /fibonacci:
    type: actionlib_tutorials/FibonacciAction
    fields: {order: {range: [0, 5]}}
    time_limit_s: 60
parameters:
  /speed: {type: double, range: [0, 1]}
launch_files:
  rospy_tutorials/001_talker_listener/talker_listener.launch: {time_limit_s: 60, per_minute: 1}
recordings:
  /say: {time_limit_s: 30}
"""
TOOLS = {
    *("read_policy", "publish", "call_service", "set_parameter", "send_goal", "cancel_goal"),
    *("start_launch", "record", "list_runs", "stop_run"),
}
DRIVE = {"topic": "/cmd_vel", "message": {"linear": {"x": 0.2}}}


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text(POLICY)
    return path


Make = Callable[..., LocalAssistant]


@pytest.fixture
def make_assistant(master: Master, policy: Path, tmp_path: Path) -> Iterator[Make]:
    """Return a function that creates an assistant with the policy. Its arguments replace limits."""
    made: list[LocalAssistant] = []

    def make(**limits: Any) -> LocalAssistant:
        bags = tmp_path / "bags"
        bags.mkdir(exist_ok=True)
        made.append(LocalAssistant(master.uri, bags, policy, **limits))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.fixture
def assistant(make_assistant: Make) -> LocalAssistant:
    return make_assistant()


def approved(assistant: LocalAssistant, tool: str, **arguments: Any) -> Reply:
    """Call a tool, which a human approves once."""
    with Human(assistant.approvals) as human:
        reply = assistant.call(tool, **arguments)
    assert len(human.seen) == 1
    return reply


def reason(reply: Reply) -> str:
    """Return why an act was refused."""
    assert reply.fields["error"] == "this act is refused; data has the reason"
    return str(reply.data)


@pytest.fixture
def driven(make_node: MakeNode) -> Inbox:
    inbox = Inbox()
    make_node("robot").subscribe("/cmd_vel", Twist, inbox)
    return inbox


def test_a_policy_adds_the_tools_that_it_names(assistant: LocalAssistant, master: Master, tmp_path) -> None:
    reading = {tool.name for tool in LocalAssistant(master.uri).tools()}
    found = {tool.name: tool for tool in assistant.tools()}
    assert not reading & TOOLS
    assert set(found) - reading == TOOLS
    for name in TOOLS:
        schema = found[name].input_schema
        jsonschema.Draft202012Validator.check_schema(schema)
        assert "context" not in schema["properties"]
        assert found[name].annotations.read_only_hint is (name in ("read_policy", "list_runs"))
    (tmp_path / "speed.yaml").write_text("parameters: {/speed: {type: int}}\n")
    narrow = LocalAssistant(master.uri, policy=tmp_path / "speed.yaml")
    assert {tool.name for tool in narrow.tools()} - reading == {"read_policy", "set_parameter"}


def test_an_approved_message_is_published_and_logged(
    assistant: LocalAssistant, make_node: MakeNode, driven: Inbox
) -> None:
    logged = Inbox()
    make_node("observer").subscribe("/pipros/acts", String, logged)
    with Human(assistant.approvals) as human:
        reply = assistant.call("publish", **DRIVE)
    assert not reply.is_error, reply.text
    assert driven.wait(1)[0].linear.x == 0.2
    [seen] = human.seen
    assert (seen["tool"], seen["name"]) == ("publish", "/cmd_vel")
    assert json.loads(seen["values"])["linear"] == {"x": 0.2, "y": 0.0, "z": 0.0}
    assert seen["rule"] == "robot.yaml:2: topics./cmd_vel, at most 1000 a minute, stopped after 0.5 s"
    assert 0 < seen["left_s"] <= 45
    acts = assistant.approvals.answer({"do": "list"})["acts"]
    assert [each["outcome"] for each in acts] == ["done", "approved"]
    assert acts[1]["approval"] == "once"
    # The observer may have connected after the first message.
    assert json.loads(logged.wait(1)[-1].data)["tool"] == "publish"


def test_a_robot_stops_after_the_last_message_of_a_call(assistant: LocalAssistant, driven: Inbox) -> None:
    reply = approved(assistant, "publish", **DRIVE, seconds=0.5, rate_hz=20)
    speeds = [message.linear.x for message in driven.wait(reply.fields["messages"] + 1)]
    assert len(speeds) > 5
    assert set(speeds[: reply.fields["messages"]]) == {0.2}
    assert speeds[reply.fields["messages"]] == 0.0, "with seconds, the stop follows"
    before = len(driven.messages)
    approved(assistant, "publish", **DRIVE)
    wait_until(lambda: [message.linear.x for message in driven.messages[before:]][:2] == [0.2, 0.0])


def test_a_human_may_refuse_or_not_answer(make_assistant: Make, driven: Inbox) -> None:
    assistant = make_assistant(assistant_approval_s=0.3)
    with Human(assistant.approvals, "refuse"):
        assert reason(assistant.call("publish", **DRIVE)) == "a human has refused this"
    assert reason(assistant.call("publish", **DRIVE)) == "no human has approved this within 0.3 s"
    with Human(assistant.approvals, "nonsense"):
        assert "no human has approved" in reason(assistant.call("publish", **DRIVE))
    outcomes = [each["outcome"] for each in assistant.approvals.answer({"do": "list"})["acts"]]
    assert outcomes == ["refused"] * 3
    assert not driven.messages


def test_a_stop_needs_no_human(assistant: LocalAssistant, driven: Inbox) -> None:
    assert not assistant.call("publish", topic="/cmd_vel", message={}).is_error
    assert driven.wait(1)[0].linear.x == 0.0


def test_an_approval_for_a_minute_is_for_the_same_tool_and_name(
    assistant: LocalAssistant, driven: Inbox
) -> None:
    with Human(assistant.approvals, "minute") as human:
        for x in (0.1, 0.2, 0.3):
            assert not assistant.call("publish", topic="/cmd_vel", message={"linear": {"x": x}}).is_error
        assert len(human.seen) == 1
        too_fast = assistant.call("publish", topic="/cmd_vel", message={"linear": {"x": 0.4}})
        assert "must be from -0.3 to 0.3 m/s" in reason(too_fast)
        assert not assistant.call("publish", topic="/say", message={"data": "hello"}).is_error
        assert [each["name"] for each in human.seen] == ["/cmd_vel", "/say"]
    assert [message.linear.x for message in driven.messages if message.linear.x] == [0.1, 0.2, 0.3]


EDGE = [0.3, -0.3, math.nextafter(0.3, 1), math.nextafter(-0.3, -1), math.nan, math.inf, -math.inf, 1e308]


@pytest.mark.parametrize("x", EDGE)
def test_values_at_the_edge_pass_and_beyond_are_refused(
    assistant: LocalAssistant, driven: Inbox, x: float
) -> None:
    with Human(assistant.approvals) as human:
        reply = assistant.call("publish", topic="/cmd_vel", message={"linear": {"x": x}})
    if abs(x) <= 0.3:
        assert not reply.is_error
        assert driven.wait(1)[0].linear.x == x
    else:
        assert reply.is_error
        assert not math.isfinite(x) or "linear.x of /cmd_vel must be" in reason(reply)
        assert human.seen == [], "a human is not asked about what the policy refuses"
        assert not driven.messages


LOOK_ALIKE = [
    "/cmd_v\u0435l", "/CMD_VEL", "/cmd_vel2", "/cmd_vel/x", "/robot/cmd_vel", "/cmd\u200b_vel", "~cmd_vel",
]  # fmt: skip


@pytest.mark.parametrize("topic", LOOK_ALIKE)
def test_names_that_look_alike_are_refused(assistant: LocalAssistant, topic: str) -> None:
    with Human(assistant.approvals) as human:
        reply = assistant.call("publish", topic=topic, message={"linear": {"x": 0.1}})
    assert reply.is_error
    assert reply.text.isascii()
    assert human.seen == []


def test_names_are_resolved_before_the_policy_decides(assistant: LocalAssistant, driven: Inbox) -> None:
    for topic in ("cmd_vel", "//cmd_vel", "/cmd_vel/"):
        with Human(assistant.approvals) as human:
            assistant.call("publish", topic=topic, message={"linear": {"x": 0.1}})
        assert {each["name"] for each in human.seen} == {"/cmd_vel"}
    wait_until(lambda: 0.1 in [each.linear.x for each in driven.messages])  # zeros follow each act


def test_a_remapping_in_the_environment_of_the_server_changes_nothing(
    master: Master, policy: Path, driven: Inbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "/other")
    with closing(LocalAssistant(master.uri, policy=policy)) as moved:
        with Human(moved.approvals) as human:
            assert "has no rule for the topic /other/cmd_vel" in reason(
                moved.call("publish", topic="cmd_vel", message={})
            )
            assert not moved.call("publish", **DRIVE).is_error
        assert [each["name"] for each in human.seen] == ["/cmd_vel"]
    assert driven.wait(1)[0].linear.x == 0.2


def test_fast_repetition_reaches_the_limit_which_both_clients_share(assistant: LocalAssistant) -> None:
    with Human(assistant.approvals, "minute"):
        replies = [assistant.call("publish", topic="/say", message={"data": "hello"}) for _ in range(3)]
    assert [reply.is_error for reply in replies] == [False, False, True]
    assert "/say exceeds the limit of 2 per minute" in reason(replies[2])
    with Human(assistant.approvals, "minute"):
        reply = assistant.call("publish", topic="/say", message={"data": "hello"}, seconds=10)
    assert "the limit of 2 per minute" in reason(reply)


def test_values_that_a_human_cannot_see_whole_are_refused(make_assistant: Make, constants: Constants) -> None:
    constants(ASSISTANT_ACT_CHARACTERS=50)
    assistant = make_assistant()
    with Human(assistant.approvals) as human:
        text = reason(assistant.call("publish", **DRIVE))
    assert "characters, too many to show to a human" in text
    assert human.seen == []


def test_a_service_is_called_and_its_time_limit_calls_the_stop(
    assistant: LocalAssistant, make_node: MakeNode
) -> None:
    calls: list[bool] = []

    def motor(request: Any) -> Any:
        calls.append(request.data)
        return SetBool._response_class(True, f"now {request.data}")

    make_node("robot").serve("/motor", SetBool, motor)
    reply = approved(assistant, "call_service", service="/motor", request={"data": True})
    assert reply.data == [{"success": True, "message": "now True"}]
    wait_until(lambda: calls[:2] == [True, False])
    wait_until(lambda: len(calls) >= 3)  # the stop is repeated
    assert not assistant.call("call_service", service="/motor", request={"data": False}).is_error
    assert "has no rule for the service /other" in reason(
        assistant.call("call_service", service="/other", request={})
    )


def test_a_parameter_is_set(assistant: LocalAssistant, make_node: MakeNode) -> None:
    params = make_node("reader").params
    assert not approved(assistant, "set_parameter", name="/speed", value=0.5).is_error
    assert params.get("/speed") == 0.5
    for value in (1.5, "0.5", True, -0.1):
        with Human(assistant.approvals) as human:
            assert "/speed must" in reason(assistant.call("set_parameter", name="/speed", value=value))
        assert human.seen == []
    assert "has no rule for the parameter /" in reason(assistant.call("set_parameter", name="/", value=1))
    assert params.get("/speed") == 0.5


class FibonacciServer:
    """An action server that succeeds at once with goals of an order below 3, and waits with the others."""

    def __init__(self, node: Node) -> None:
        self.goals: list[Any] = []
        self.cancelled: list[str] = []
        self._results = node.advertise("/fibonacci/result", Result)
        node.subscribe("/fibonacci/goal", Goal, self._receive)
        node.subscribe("/fibonacci/cancel", GoalID, lambda message: self.cancelled.append(message.id))

    def _receive(self, goal: Any) -> None:
        self.goals.append(goal)
        if goal.goal.order < 3:
            result = Result()
            result.status.goal_id, result.status.status = goal.goal_id, Status.SUCCEEDED
            result.result.sequence = [0, 1]
            wait_until(lambda: self._results.connection_count == 1)
            self._results.publish(result)


def test_goals_are_sent_and_cancelled(assistant: LocalAssistant, make_node: MakeNode) -> None:
    with Human(assistant.approvals):
        missing = assistant.call("send_goal", action="/fibonacci", goal={"order": 1})
    assert "no action server is connected" in missing.fields["error"]
    server = FibonacciServer(make_node("server"))
    reply = approved(assistant, "send_goal", action="/fibonacci", goal={"order": 2}, wait_s=10)
    assert reply.data[1] == {"status": "succeeded", "result": {"sequence": [0, 1]}}
    waiting = approved(assistant, "send_goal", action="/fibonacci", goal={"order": 5}, wait_s=0)
    identity = waiting.data[0]["goal_id"]
    assert not assistant.call("cancel_goal", goal_id=identity).is_error
    wait_until(lambda: server.cancelled[:1] == [identity])
    assert [goal.goal.order for goal in server.goals] == [2, 5]
    assert assistant.call("cancel_goal", goal_id="another").is_error
    with Human(assistant.approvals) as human:
        text = reason(assistant.call("send_goal", action="/fibonacci", goal={"order": 6}))
    assert "goal.order of /fibonacci/goal must be from 0 to 5" in text
    assert human.seen == []


def test_launch_files_and_recordings_are_started_and_stopped(
    assistant: LocalAssistant, make_node: MakeNode, tmp_path: Path
) -> None:
    node = make_node("watcher")

    def nodes() -> str:
        return str(node.master.get_system_state())

    run = approved(assistant, "start_launch", **LAUNCH).fields["run"]
    wait_until(lambda: "/talker" in nodes())
    assert "the limit of 1 per minute" in reason(assistant.call("start_launch", **LAUNCH))
    publisher = node.advertise("/say", String)
    recording = approved(assistant, "record", topics=["/say"], seconds=20).fields["run"]
    wait_until(lambda: publisher.connection_count == 1)
    publisher.publish(String("hello"))
    rows = {row["run"]: row for row in assistant.call("list_runs").data}
    assert rows[run]["is_running"] is rows[recording]["is_running"] is True
    for each in (run, recording):
        assert assistant.call("stop_run", run=each).fields["has_ended"] is True
    wait_until(lambda: "/talker" not in nodes())
    [bag] = assistant.call("list_bags").data
    assert bag == rows[recording]["name"]
    assert "has no rule for the recording /other" in reason(
        assistant.call("record", topics=["/say", "/other"], seconds=5)
    )
    assert assistant.call("stop_run", run=99).is_error


def test_runs_end_with_the_server(make_assistant: Make, make_node: MakeNode) -> None:
    node = make_node("watcher")
    assistant = make_assistant()
    approved(assistant, "start_launch", **LAUNCH)
    wait_until(lambda: "/talker" in str(node.master.get_system_state()))
    assistant.close()
    wait_until(lambda: "/talker" not in str(node.master.get_system_state()))


def test_a_condition_is_checked_again_after_the_approval(
    master: Master, tmp_path: Path, make_node: MakeNode, driven: Inbox
) -> None:
    (tmp_path / "held.yaml").write_text(
        "topics: {/cmd_vel: {type: geometry_msgs/Twist, fields: any, requires: held}}\n"
        "conditions:\n"
        "  held: {topic: /joy, type: sensor_msgs/Joy, field: 'buttons[0]', one_of: [1], max_age_s: 60}\n"
    )
    assistant = LocalAssistant(master.uri, policy=tmp_path / "held.yaml")
    joy = make_node("joy").advertise("/joy", Joy, latch=True)
    try:
        assert "the condition held does not hold" in reason(assistant.call("publish", **DRIVE))
        joy.publish(Joy(buttons=[1]))
        assert assistant.acts is not None
        gate = assistant.acts.system().gate
        wait_until(lambda: "held" in gate._state.readings, what="the first message")

        class Releasing(Human):
            """Releases the button, and then approves."""

            def _answer(self) -> None:
                waiting = self._approvals
                wait_until(lambda: waiting.answer({"do": "list"})["waiting"])
                joy.publish(Joy(buttons=[0]))
                wait_until(lambda: gate._state.readings["held"].reason)
                super()._answer()

        with Releasing(assistant.approvals):
            text = reason(assistant.call("publish", **DRIVE))
        assert "must be one of 1; got 0" in text
        assert not driven.messages
    finally:
        assistant.close()


def test_after_a_new_master_the_next_act_connects_again(policy: Path) -> None:
    with Master(port=0) as first:
        uri = first.uri
        assistant = LocalAssistant(uri, policy=policy)
        assert not approved(assistant, "set_parameter", name="/speed", value=0.1).is_error
    try:
        assert assistant.call("publish", **DRIVE).fields["error"] == "the call failed; data has the reason"
        with (
            Master(port=int(uri.rstrip("/").rpartition(":")[2])),
            Node("reader", environment=Environment(master_uri=uri)) as node,
        ):
            assert not approved(assistant, "set_parameter", name="/speed", value=0.2).is_error
            assert node.params.get("/speed") == 0.2
    finally:
        assistant.close()
