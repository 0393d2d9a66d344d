"""Attacks on the acts of assistants: clients that cheat, vanish or flood, changed files, killed servers."""

import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_assistants.http_server import ASSISTANT_SESSIONS
from pipros_server.approvals import answer_act, waiting_acts
from pipros_server.guardian_process import REPETITIONS
from tests.graph.test_assistant_command import TOKEN, over_http
from tests.support.assistants import LocalAssistant, call, run
from tests.support.nodes import Inbox, MakeNode
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Twist: Any = load_message_class("geometry_msgs/Twist")
String: Any = load_message_class("std_msgs/String")
LAUNCH = "rospy_tutorials/001_talker_listener/talker_listener.launch"
POLICY = f"""\
topics:
  /cmd_vel:
    type: geometry_msgs/Twist
    fields: {{linear.x: {{range: [-0.3, 0.3], unit: m/s}}}}
    time_limit_s: 3000
services: {{/motor: {{type: std_srvs/SetBool, fields: any}}}}
actions: {{/fibonacci: {{type: actionlib_tutorials/FibonacciAction, fields: any}}}}
parameters: {{/speed: {{type: double, range: [0, 1]}}}}
launch_files: {{{LAUNCH}: {{time_limit_s: 600}}, robot/launch/out.launch: {{time_limit_s: 600}}}}
recordings: {{/chatter: {{time_limit_s: 600}}}}
"""
DRIVE = {"topic": "/cmd_vel", "message": {"linear": {"x": 0.2}}}


@pytest.fixture
def system(ros: RosSystem, monkeypatch: pytest.MonkeyPatch) -> RosSystem:
    ros.serve_master()
    (ros.home / "policy.yaml").write_text(POLICY)
    (ros.home / "bags").mkdir()
    tokens = ros.home / "tokens"
    tokens.write_text(f"{TOKEN}\nanother-token-of-this-test\n")
    tokens.chmod(0o600)
    monkeypatch.setenv("ROS_HOME", ros.pipros.environment["ROS_HOME"])
    return ros


Serve = Callable[..., tuple[Process, int]]


@pytest.fixture
def serve(system: RosSystem) -> Serve:
    """Return a function that starts the server over HTTP."""

    def start(**variables: str) -> tuple[Process, int]:
        server = system.pipros.start(
            *("pipros", "mcp", "--http", "0", "--token-file", system.home / "tokens"),
            *("--policy", system.home / "policy.yaml", "--bags", system.home / "bags"),
            **variables,
        )
        return server, int(server.wait_for(r"http://127\.0\.0\.1:(\d+)/mcp")[1])

    return start


@contextlib.contextmanager
def human(verdict: str = "once") -> Iterator[list[Any]]:
    """Answer all acts of this user's servers. The value is the list of them."""
    over, seen = threading.Event(), []

    def answer() -> None:
        while not over.wait(0.02):
            for program in waiting_acts():
                for act in program["waiting"]:
                    with contextlib.suppress(PiprosError):
                        answer_act(program["process"], act["id"], verdict)
                        seen.append(act)

    thread = threading.Thread(target=answer, daemon=True)
    thread.start()
    try:
        yield seen
    finally:
        over.set()
        thread.join()


@pytest.fixture
def robot(system: RosSystem) -> Iterator[Node]:
    with Node("robot", environment=Environment(master_uri=system.master_uri)) as node:
        yield node


def test_an_approval_for_a_minute_is_not_for_another_client(serve: Serve, robot: Node) -> None:
    driven = Inbox()
    robot.subscribe("/cmd_vel", Twist, driven)
    _, port = serve(PIPROS_LIMITS="assistant_approval_s=1")

    async def drive(client: Any) -> Any:
        return await call(client, "publish", **DRIVE)

    with human("minute") as seen:
        assert not run(over_http(port), drive).is_error
    assert len(seen) == 1
    other = run(over_http(port, "another-token-of-this-test"), drive)
    assert "no human has approved this within 1 s" in other.data
    assert len(driven.messages) == 1


def opened(port: int, token: str) -> tuple[int, Callable[..., int]]:
    """Open a session. Return the status, and a function that sends a request in it and returns the status.

    The request lists the tools, or calls the given one.
    """
    headers = {
        "Authorization": f"Bearer {token}",
        "Content-Type": "application/json",
        "Accept": "application/json, text/event-stream",
    }

    def post(**message: Any) -> Any:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.request("POST", "/mcp", json.dumps({"jsonrpc": "2.0", **message}), headers)
        answer = connection.getresponse()
        answer.read()
        connection.close()
        return answer

    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    answer = post(id=1, method="initialize", params=about)
    headers["mcp-session-id"] = answer.headers.get("mcp-session-id", "")
    post(method="notifications/initialized")

    def request(tool: str = "", number: int = 2) -> int:
        method, params = ("tools/call", {"name": tool, "arguments": {}}) if tool else ("tools/list", {})
        return int(post(id=number, method=method, params=params).status)

    return answer.status, request


@pytest.mark.parametrize("other", ["another-token-of-this-test", TOKEN])
def test_many_sessions_shut_out_no_other_client_and_no_session_in_use(serve: Serve, other: str) -> None:
    _, port = serve()
    status, lists = opened(port, TOKEN)
    assert (status, lists()) == (200, 200)
    assert [opened(port, other)[0] for _ in range(40)] == [200] * 40
    assert (lists(), opened(port, TOKEN)[0]) == (200, 200)


def test_sessions_in_use_take_neither_sessions_nor_places_from_others(serve: Serve) -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:  # a master that never answers
        _, port = serve(ROS_MASTER_URI=f"http://127.0.0.1:{mute.getsockname()[1]}")
        _, quiet = opened(port, "another-token-of-this-test")
        calls: list[threading.Thread] = []
        while (session := opened(port, TOKEN))[0] == 200:
            calls.append(threading.Thread(target=session[1], args=("list_topics",)))
            calls[-1].start()
        assert session[0] == 503
        assert len(calls) >= ASSISTANT_SESSIONS - 1
        assert (quiet("list_bags"), opened(port, "another-token-of-this-test")[0]) == (200, 200)
    for each in calls:
        each.join()


def test_a_client_that_keeps_connections_open_does_not_shut_out_others(serve: Serve) -> None:
    _, port = serve()
    with contextlib.ExitStack() as kept:
        for _ in range(4 * ASSISTANT_SESSIONS):
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
            kept.enter_context(contextlib.closing(connection))
            connection.request("GET", "/none", headers={"Authorization": f"Bearer {TOKEN}"})
            assert connection.getresponse().read()
        assert opened(port, "another-token-of-this-test")[0] == 200


def test_slow_calls_of_a_client_do_not_keep_another_one_waiting(serve: Serve) -> None:
    done: list[int] = []
    with socket.create_server(("127.0.0.1", 0)) as mute:  # a master that never answers
        _, port = serve(ROS_MASTER_URI=f"http://127.0.0.1:{mute.getsockname()[1]}")
        sessions = [opened(port, TOKEN)[1] for _ in range(4)]
        _, other = opened(port, "another-token-of-this-test")
        calls = [
            threading.Thread(target=lambda n=n, slow=slow: done.append(slow("list_topics", n)))  # type: ignore[misc]
            for n, slow in enumerate(2 * sessions, 10)
        ]
        for each in calls:
            each.start()
        wait_until(lambda: done, 60, "the first answer, while all others wait")
        assert other("list_bags") == 200
        assert len(done) < len(calls) / 2
        for each in calls:
            each.join()
    assert done == [200] * len(calls)


def test_odd_requests_of_a_client_are_answered_or_forgotten(serve: Serve) -> None:
    done: list[int] = []
    with socket.create_server(("127.0.0.1", 0)) as mute:  # a master that never answers
        server, port = serve(ROS_MASTER_URI=f"http://127.0.0.1:{mute.getsockname()[1]}")
        _, request = opened(port, TOKEN)
        same = [threading.Thread(target=lambda: done.append(request("list_topics", 7))) for _ in range(3)]
        for each in same:
            each.start()
        with mute.accept()[0]:
            assert ([request("list_bags", 8) for _ in range(20)], done) == ([200] * 20, [])
    wait_until(lambda: done == [200] * 3, 60)
    with socket.create_connection(("127.0.0.1", port), 30) as ending:
        head = f"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAuthorization: Bearer {TOKEN}\r\nAccept: "
        head += "application/json, text/event-stream\r\nContent-Type: application/json\r\n"
        ending.sendall(f"{head}Content-Length: 9\r\n\r\n{{".encode())
    assert request("list_bags", 7) == 200
    assert "Traceback" not in server.output


def test_a_robot_stops_soon_after_a_client_over_http_has_gone(serve: Serve, robot: Node) -> None:
    driven = Inbox()
    robot.subscribe("/cmd_vel", Twist, driven)
    _, port = serve()
    headers = {
        "Authorization": f"Bearer {TOKEN}",
        "Content-Type": "application/json",
        "Accept": "application/json, text/event-stream",
    }

    def post(connection: http.client.HTTPConnection, **message: Any) -> Any:
        connection.request("POST", "/mcp", json.dumps({"jsonrpc": "2.0", **message}), headers)

    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    post(connection, id=1, method="initialize", params=about)
    answer = connection.getresponse()
    headers["mcp-session-id"] = answer.headers["mcp-session-id"]
    answer.read()
    post(connection, method="notifications/initialized")
    connection.getresponse().read()
    drive = {"name": "publish", "arguments": {**DRIVE, "seconds": 10, "rate_hz": 20}}
    with human():
        post(connection, id=2, method="tools/call", params=drive)
        driven.wait(1)
    began_s = time.monotonic()
    connection.close()
    wait_until(lambda: driven.messages[-1].linear.x == 0)
    assert len(driven.messages) < 150, "of 200"
    assert time.monotonic() - began_s < 8


def test_nodes_and_recordings_end_when_the_server_is_killed(
    serve: Serve, robot: Node, system: RosSystem
) -> None:
    server, port = serve()
    publisher = robot.advertise("/chatter", String)

    async def start(client: Any) -> None:
        package, _, file = LAUNCH.partition("/")
        assert not (await call(client, "start_launch", package=package, file=file)).is_error
        assert not (await call(client, "record", topics=["/chatter"], seconds=600)).is_error

    def nodes() -> str:
        return str(robot.master.get_system_state())

    with human():
        run(over_http(port), start)
    wait_until(lambda: "/talker" in nodes() and "/record" in nodes())
    wait_until(lambda: publisher.connection_count)
    server.kill()
    wait_until(lambda: "/talker" not in nodes() and "/record" not in nodes())
    wait_until(lambda: [each.suffix for each in (system.home / "bags").iterdir()] == [".bag"])


def test_a_robot_stops_when_the_server_is_killed_during_an_act(serve: Serve, robot: Node) -> None:
    driven = Inbox()
    robot.subscribe("/cmd_vel", Twist, driven)
    server, port = serve()

    async def drive(client: Any) -> None:
        await call(client, "publish", **DRIVE, seconds=10)

    def ask() -> None:
        with contextlib.suppress(BaseException):  # the connection ends
            run(over_http(port), drive)

    thread = threading.Thread(target=ask)
    with human():
        thread.start()
        driven.wait(3)
        server.kill()
    wait_until(lambda: [message.linear.x for message in driven.messages].count(0.0) == REPETITIONS)
    assert driven.messages[-1].linear.x == 0.0
    thread.join()


def test_the_policy_in_force_is_that_of_the_start(serve: Serve, system: RosSystem, robot: Node) -> None:
    _, port = serve()
    (system.home / "policy.yaml").write_text(POLICY.replace("0.3", "9.0"))

    async def ask(client: Any) -> tuple[Any, Any]:
        fast = {"topic": "/cmd_vel", "message": {"linear": {"x": 5.0}}}
        return await call(client, "read_policy"), await call(client, "publish", **fast)

    shown, fast = run(over_http(port), ask)
    assert shown.data == POLICY.splitlines()
    assert "must be from -0.3 to 0.3 m/s, got 5 m/s" in fast.data
    del robot


def test_no_node_of_the_robot_can_approve(serve: Serve, robot: Node) -> None:
    _, port = serve(PIPROS_LIMITS="assistant_approval_s=2")
    spoof = robot.advertise("/pipros/acts", String)
    replies: list[Any] = []

    async def drive(client: Any) -> None:
        replies.append(await call(client, "publish", **DRIVE))

    thread = threading.Thread(target=run, args=(over_http(port), drive))
    thread.start()
    found: list[Any] = []

    def waits() -> bool:
        found[:] = [act for program in waiting_acts() for act in program["waiting"]]
        return bool(found)

    wait_until(waits)
    spoof.publish(
        String(json.dumps({"do": "answer", "id": found[0]["id"], "verdict": "once", "outcome": "approved"}))
    )
    services = [name for name, _ in robot.master.get_system_state()[2]]
    thread.join()
    assert not [
        name for name in services if "pipros_acts" in name and not name.endswith(("_loggers", "_level"))
    ]
    assert "no human has approved this within 2 s" in replies[0].data


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package with a link to a launch file outside."""
    launch = tmp_path / "src" / "robot" / "launch"
    launch.mkdir(parents=True)
    (launch.parent / "package.xml").write_text(
        "<package format='2'><name>robot</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='m@example.org'>m</maintainer><license>none</license></package>"
    )
    (tmp_path / "other.launch").write_text("<launch/>")
    (launch / "out.launch").symlink_to(tmp_path / "other.launch")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))


@pytest.fixture
def assistant(master: Master, tmp_path: Path, workspace: None) -> Iterator[LocalAssistant]:
    del workspace
    (tmp_path / "policy.yaml").write_text(POLICY)
    (tmp_path / "bags").mkdir()
    found = LocalAssistant(master.uri, tmp_path / "bags", tmp_path / "policy.yaml", assistant_approval_s=0.01)
    yield found
    found.close()


def test_a_launch_file_behind_a_link_is_not_started(assistant: LocalAssistant) -> None:
    linked = assistant.call("start_launch", package="robot", file="launch/out.launch")
    assert "links out of it are not followed" in linked.data
    for file in (
        "../robot/launch/out.launch",
        "launch/../launch/out.launch",
        "$(find robot)/launch/out.launch",
    ):
        assert assistant.call("start_launch", package="robot", file=file).is_error
    assert assistant.call("list_runs").data == []


def test_a_flood_of_acts_leaves_no_one_waiting_behind(assistant: LocalAssistant) -> None:
    before = threading.active_count()
    replies = []
    threads = [
        threading.Thread(target=lambda: replies.append(assistant.call("publish", **DRIVE))) for _ in range(40)
    ]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert all(reply.is_error for reply in replies)
    assert assistant.approvals.answer({"do": "list"})["waiting"] == []
    assert threading.active_count() < before + 40


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=6,
)
NAMES = st.sampled_from(["/cmd_vel", "/motor", "/fibonacci", "/speed", "/chatter", LAUNCH, ""]) | st.text(
    max_size=9
)
FIELDS = st.sampled_from(["linear", "data", "order", "x"])
MESSAGES = st.dictionaries(FIELDS, VALUES | st.dictionaries(FIELDS, VALUES, max_size=2), max_size=2)
TOOLS = (
    "publish", "call_service", "set_parameter", "send_goal", "cancel_goal", "start_launch", "record",
    "stop_run",
)  # fmt: skip


@settings(deadline=None, max_examples=40, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_no_arguments_break_a_tool_or_reach_the_robot_without_approval(
    assistant: LocalAssistant, make_node: MakeNode, data: st.DataObject
) -> None:
    del make_node
    schemas = {tool.name: tool.input_schema["properties"] for tool in assistant.tools()}
    name = data.draw(st.sampled_from(TOOLS))
    arguments = {
        key: data.draw(NAMES if key not in ("message", "request", "goal", "value") else MESSAGES | VALUES)
        for key in schemas[name]
        if key not in ("seconds", "rate_hz", "wait_s", "run") or data.draw(st.booleans())
    }
    text, is_error = assistant.reply(name, arguments)
    assert text.isprintable()
    json.loads(text)
    if not is_error:
        acts = assistant.approvals.answer({"do": "list"})["acts"]
        assert acts[0]["approval" if acts[0]["outcome"] == "approved" else "outcome"] in (
            "done",
            "not needed, because it stops",
        )
