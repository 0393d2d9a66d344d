"""`pipros mcp` as a command: every tool over each transport, and who may connect over HTTP."""

import base64
import contextlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import httpx2
import pytest
from mcp import Client, StdioServerParameters
from mcp.client.streamable_http import streamable_http_client

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_assistants.stdio_transport import ASSISTANT_REQUEST_BYTES
from tests.support.assistants import call, run
from tests.support.bags import bag_bytes, some_rows
from tests.support.environments import REPOSITORY
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
OccupancyGrid: Any = load_message_class("nav_msgs/OccupancyGrid")
SetBool: Any = load_service_class("std_srvs/SetBool")

TOKEN = "a-token-for-this-test"  # noqa: S105

CALLS: dict[str, dict[str, Any]] = {
    "describe_bag": {"bag": "run.bag"}, "describe_service": {"service": "/enable"}, "doctor": {},
    "find_transform": {"target": "map", "source": "base", "wait_s": 0.1}, "list_actions": {}, "list_bags": {},
    "list_frames": {"wait_s": 0.1}, "list_launch_files": {"package": "rospy_tutorials"}, "list_nodes": {},
    "list_packages": {}, "list_parameters": {}, "list_services": {}, "list_topics": {},
    "plot_bag": {"bag": "run.bag", "topic": "/a", "parts": ["data"]},
    "query_bag": {"bag": "run.bag", "sql": "SELECT count(*) AS n FROM a"},
    "read_bag": {"bag": "run.bag", "topic": "/a"}, "read_diagnostics": {"wait_s": 0.1},
    "read_launch_file": {"package": "rospy_tutorials", "file": "001_talker_listener/talker_listener.launch"},
    "read_logs": {"wait_s": 0.1}, "read_parameter": {"name": "/rosdistro"},
    "read_topic": {"topic": "/chatter"}, "show_bag": {"bag": "run.bag", "topic": "/a"},
    "show_definition": {"type": "std_msgs/String"}, "show_topic": {"topic": "/map"},
    "summarize_bag": {"bag": "run.bag", "topic": "/a"},
    "summarize_topic": {"topic": "/chatter", "seconds": 0.3},
    "why_no_data": {"topic": "/chatter", "wait_s": 0.3},
}  # fmt: skip
"""A call of every tool."""

FAILING = {"find_transform", "show_bag"}
"""Tools that this system refuses: it publishes no frames, and a number cannot be drawn."""


@pytest.fixture
def system(ros: RosSystem, tmp_path: Path) -> RosSystem:
    """A system with a bag in `ros.home / "bags"`, and a file of tokens."""
    ros.serve_master()
    bags = ros.home / "bags"
    bags.mkdir()
    (bags / "run.bag").write_bytes(bag_bytes(some_rows()))
    tokens = ros.home / "tokens"
    tokens.write_text(f"{TOKEN}\n")
    tokens.chmod(0o600)
    return ros


def over_stdio(ros: RosSystem) -> AbstractAsyncContextManager[Client]:
    command = [
        *("-c", "from pipros_tools.cli.pipros import main; main()"), "mcp", "--bags", str(ros.home / "bags"),
    ]  # fmt: skip
    environment = ros.pipros.environment
    return Client(
        StdioServerParameters(command=sys.executable, args=command, env=environment, cwd=str(ros.home))
    )


def start_http(ros: RosSystem) -> tuple[Process, int]:
    """Start the server, and return it with its port."""
    server = ros.pipros.start(
        "pipros", "mcp", "--http", "0", "--token-file", ros.home / "tokens", "--bags", ros.home / "bags"
    )
    return server, int(server.wait_for(r"http://127\.0\.0\.1:(\d+)/mcp")[1])


@contextlib.asynccontextmanager
async def over_http(port: int, token: str = TOKEN) -> AsyncIterator[Client]:
    headers = {"Authorization": f"Bearer {token}"}
    async with httpx2.AsyncClient(headers=headers, timeout=60.0) as connection:
        transport = streamable_http_client(f"http://127.0.0.1:{port}/mcp", http_client=connection)
        async with Client(transport) as client:
            yield client


async def call_every_tool(client: Client) -> dict[str, Any]:
    names = {tool.name for tool in (await client.list_tools()).tools}
    assert names == set(CALLS)
    return {name: await call(client, name, **arguments) for name, arguments in CALLS.items()}


@pytest.mark.parametrize("transport", ["stdio", "http"])
def test_every_tool_answers(system: RosSystem, transport: str) -> None:
    server = None
    with Node("talker", environment=Environment(master_uri=system.master_uri)) as node:
        node.advertise("/chatter", String, latch=True).publish(String("hello"))
        grid = OccupancyGrid(data=[0, 100])
        grid.info.width, grid.info.height = 2, 1
        node.advertise("/map", OccupancyGrid, latch=True).publish(grid)
        node.serve("/enable", SetBool, lambda request: None)
        if transport == "stdio":
            replies = run(over_stdio(system), call_every_tool)
        else:
            server, port = start_http(system)
            replies = run(over_http(port), call_every_tool)
    assert {name for name, reply in replies.items() if reply.is_error} == FAILING
    assert replies["read_topic"].data[1]["message"] == {"data": "hello"}
    assert (replies["query_bag"].data, replies["list_bags"].data) == ([["n"], ["15"]], ["run.bag"])
    assert replies["read_bag"].data[0] == {"time_s": 0.0, "message": {"data": 0}}
    assert any("<launch>" in line for line in replies["read_launch_file"].data)
    assert {"/chatter", "/map"} <= {row["topic"] for row in replies["list_topics"].data}
    for name in ("plot_bag", "show_topic"):
        [picture] = replies[name].pictures
        assert base64.b64decode(picture.data).startswith(b"\x89PNG")
    if server is not None:
        server.press_ctrl_c()
        assert server.wait() == 0


def request(port: int, **headers: str) -> tuple[int, str]:
    """Send a request to list the tools; return the status and the body."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    body = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {}})
    fixed = {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}
    with contextlib.closing(connection):
        connection.request("POST", "/mcp", body, {**fixed, **headers})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


def test_only_clients_with_token_host_and_origin_are_served(system: RosSystem) -> None:
    _, port = start_http(system)
    good = {"Authorization": f"Bearer {TOKEN}"}
    wrong: list[dict[str, str]] = [
        {}, {"Authorization": "Bearer another-token-of-some-length"}, {"Authorization": f"Basic {TOKEN}"},
        {**good, "Host": f"evil.example:{port}"}, {**good, "Origin": "http://evil.example"},
        {**good, "Origin": "null"}, {**good, "Origin": "http://localhost:1"},
    ]  # fmt: skip
    for headers in wrong:
        status, body = request(port, **headers)
        assert status == 403, headers
        assert "error" in json.loads(body)
    assert request(port, **good)[0] != 403
    assert request(port, **good, Origin=f"http://127.0.0.1:{port}")[0] != 403
    assert "list_topics" in str(run(over_http(port), lambda client: client.list_tools()))


def test_connections_without_a_token_are_closed(system: RosSystem) -> None:
    server = system.pipros.start(
        "pipros", "mcp", "--http", "0", "--token-file", system.home / "tokens", PIPROS_LIMITS="login_s=0.2"
    )
    port = int(server.wait_for(r"http://127\.0\.0\.1:(\d+)/mcp")[1])
    with socket.create_connection(("127.0.0.1", port), 30) as silent:
        silent.sendall(b"POST /mcp HTTP/1.1\r\n")
        assert silent.recv(100) == b""


def test_large_requests_are_refused(system: RosSystem) -> None:
    server = system.pipros.start(*("pipros", "mcp", "--http", "0", "--token-file", system.home / "tokens"))
    port = int(server.wait_for(r"http://127\.0\.0\.1:(\d+)/mcp")[1])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    headers = {"Content-Type": "application/json", "Authorization": f"Bearer {TOKEN}"}
    with contextlib.closing(connection):
        connection.putrequest("POST", "/mcp")
        for name, value in {**headers, "Content-Length": str(ASSISTANT_REQUEST_BYTES + 1)}.items():
            connection.putheader(name, value)
        connection.endheaders()
        assert connection.getresponse().status == 413


def test_a_line_that_is_too_long_is_refused_and_later_ones_are_answered(system: RosSystem) -> None:
    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    first = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": about})
    ping = json.dumps({"jsonrpc": "2.0", "id": 2, "method": "ping"})
    command = [sys.executable, "-c", "from pipros_tools.cli.pipros import main; main()", "mcp"]
    limit_bytes = ASSISTANT_REQUEST_BYTES
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    long, third = f"{ping:<{10 * limit_bytes}}", json.dumps({"jsonrpc": "2.0", "id": 3, "method": "ping"})
    answers = []
    with subprocess.Popen(command, env=system.pipros.environment, text=True, **pipes) as program:
        assert program.stdin is not None
        assert program.stdout is not None
        try:
            for line in (
                first, f"{ping:<{limit_bytes - 1}}", f"{ping:<{limit_bytes}}", long, third,
                "{" * (4 * limit_bytes),
            ):  # fmt: skip
                program.stdin.write(f"{line}\n")
                program.stdin.flush()
                answers.append(json.loads(program.stdout.readline()))
            program.stdin.close()
            assert program.wait(60) == 0
        finally:
            program.kill()

    limit = f"the limit is {limit_bytes} bytes"
    text = f"the line is too long; {limit}. Send shorter requests"
    refusal = {"jsonrpc": "2.0", "id": None, "error": {"code": -32600, "message": text}}
    assert answers[0]["result"]["serverInfo"]["name"] == "pipros"
    assert (answers[1], answers[2:4]) == ({"jsonrpc": "2.0", "id": 2, "result": {}}, [refusal, refusal])
    assert (answers[4], answers[5]) == ({"jsonrpc": "2.0", "id": 3, "result": {}}, refusal)


def test_no_login_is_offered(system: RosSystem) -> None:
    _, port = start_http(system)
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    with contextlib.closing(connection):
        connection.request("GET", "/.well-known/oauth-protected-resource")
        answer = connection.getresponse()
        assert (answer.status, answer.headers.get("WWW-Authenticate")) == (403, None)


def test_a_client_that_has_ended_leaves_no_traceback(system: RosSystem) -> None:
    command = [sys.executable, "-c", "from pipros_tools.cli.pipros import main; main()", "mcp"]
    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    first = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": about})
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ended = subprocess.run(
            command, input=f"{first}\n", stdout=writing, stderr=subprocess.PIPE,
            env=system.pipros.environment, text=True, timeout=60, check=False,
        )  # fmt: skip
    finally:
        os.close(writing)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_without_a_token_file_a_token_is_printed(system: RosSystem) -> None:
    server = system.pipros.start("pipros", "mcp", "--http", "0")
    port = int(server.wait_for(r"http://127\.0\.0\.1:(\d+)/mcp")[1])
    token = server.wait_for(r"TOKEN is (\S+)\.")[1]
    assert request(port, Authorization=f"Bearer {token}")[0] != 403
    head = f"POST /mcp HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAuthorization: Bearer {token}\r\n"
    head += "Accept: application/json, text/event-stream\r\nContent-Type: application/json\r\n"
    with socket.create_connection(("127.0.0.1", port)) as unfinished:
        unfinished.sendall(f"{head}Content-Length: 9\r\nExpect: 100-continue\r\n\r\n".encode())
        unfinished.settimeout(30)
        assert unfinished.recv(100).startswith(b"HTTP/1.1 100 ")  # the request is being served
        server.press_ctrl_c()
        wait_until(lambda: not server.is_running, 30, "the end")
    assert re.search("Traceback|ERROR|WARNING|Cancel", server.output) is None


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=str)
def test_a_signal_ends_the_server_and_its_node(system: RosSystem, number: int) -> None:
    def names() -> str:
        with ServerProxy(system.master_uri) as master:
            return str(master.getSystemState("/test"))

    server = system.pipros.processes.start("pipros", "mcp", stdin=subprocess.PIPE)
    with Node("talker", environment=Environment(master_uri=system.master_uri)) as node:
        node.advertise("/silent", String)
        wait_until(lambda: "/silent" in names(), 30, "the topic")
        client = {
            "protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}
        }  # fmt: skip
        reading = {"name": "read_topic", "arguments": {"topic": "/silent", "wait_s": 30}}
        server.write_line(json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": client}))
        server.wait_for('"result"')
        server.write_line(json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}))
        server.write_line(json.dumps({"jsonrpc": "2.0", "id": 2, "method": "tools/call", "params": reading}))
        wait_until(lambda: "pipros_mcp" in names(), 30, "the node of the call")
        server.send_signal(number)
        assert server.wait(15) == 128 + number
        assert "pipros_mcp" not in names()


@pytest.mark.parametrize("library", ["mcp", "uvicorn"])
def test_without_a_library_one_line_says_what_to_install(ros: RosSystem, library: str) -> None:
    hidden = ros.home / "hidden" / library
    hidden.mkdir(parents=True)
    (hidden / "__init__.py").write_text(f"raise ModuleNotFoundError('absent', name={library!r})\n")
    ended = ros.pipros.run("pipros", "mcp", "--http", "0", PYTHONPATH=str(hidden.parent))
    assert ended.returncode == 1
    [line] = ended.stderr
    assert line.startswith(f"ERROR: pipros mcp needs {library}, which is not installed. Try: ")
    assert "pipros-assistants" in line


@pytest.mark.parametrize(
    "arguments", [("--http", "70000"), ("--token-file", "x"), ("--bags", "missing")], ids=str
)
def test_wrong_arguments_are_named(ros: RosSystem, arguments: tuple[str, str]) -> None:
    ended = ros.pipros.run("pipros", "mcp", *arguments)
    assert ended.returncode in (1, 2)
    assert arguments[0] in ended.stderr[-1]


# `pipros mcp` as a user tries it, with a scripted client: what stands in docs/guides/assistants.md.


LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
PAGE = (REPOSITORY / "plugins" / "pipros-assistants" / "docs" / "guides" / "assistants.md").read_text(
    encoding="utf-8"
)
[DRIVE] = re.findall(r'^```yaml title="drive\.yaml"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
APPROVE, EXAMPLE = re.findall(r"^```console\n\$ (.*?)\n", PAGE, re.MULTILINE)


def test_a_robot_drives_to_a_pose_with_one_approval(ros: RosSystem) -> None:
    (ros.home / "drive.yaml").write_text(DRIVE)
    shutil.copy(REPOSITORY / "examples" / "assistant" / "drive_to_pose.py", ros.home)
    human = ros.pipros.open_terminal()
    human.type(APPROVE)
    human.wait_for("Waiting for acts")
    client = ros.pipros.start(*EXAMPLE.replace("python3", sys.executable, 1).split())
    human.wait_for(r"n: refuse > ")
    shown = human.output
    for expected in (
        "tool    publish\n", "name    /cmd_vel\n", '"angular": {"x": 0.0, "y": 0.0, "z": -0.8}',
        "rule    drive.yaml:2: topics./cmd_vel, at most 600 a minute, stopped after 0.5 s\n",
        "master  http://localhost:", " s left. ",
    ):  # fmt: skip
        assert expected in shown
    human.answer("m")
    human.wait_for("Answered: minute.")
    assert client.wait(120) == 0
    places = re.findall(r"at \((.*), (.*)\), (.*) m to go", client.output)
    assert float(places[-1][2]) < 0.1
    assert len(places) > 2
    assert "n: refuse" not in human.output.partition("Answered")[2], "one approval was enough"
    human.press_ctrl_c()
    assert human.wait_for_prompt() == 130


def test_an_act_that_a_human_refuses_does_not_happen(ros: RosSystem) -> None:
    (ros.home / "drive.yaml").write_text(DRIVE)
    shutil.copy(REPOSITORY / "examples" / "assistant" / "drive_to_pose.py", ros.home)
    human = ros.pipros.open_terminal()
    human.type(APPROVE)
    client = ros.pipros.start(*EXAMPLE.replace("python3", sys.executable, 1).split())
    human.wait_for(r"n: refuse > ")
    human.answer("n")
    assert client.wait(120) == 1
    client.wait_for("this act is refused; data has the reason: a human has refused this")
    assert client.output.count(" m to go") == 1


@pytest.fixture
def home(ros: RosSystem) -> Path:
    ros.serve_master()
    bags = ros.home / "bags"
    bags.mkdir()
    (bags / "run.bag").write_bytes(bag_bytes(some_rows()))
    return ros.home


def test_a_client_finds_why_a_topic_is_silent_and_plots_from_a_bag(ros: RosSystem, home: Path) -> None:
    del home

    async def look(client: Any) -> tuple[str, bytes]:
        topics = {row["topic"]: row for row in (await call(client, "list_topics")).data}
        [silent] = [name for name, row in topics.items() if row["subscribers"] and not row["publishers"]]
        rows = (await call(client, "why_no_data", topic=silent, wait_s=0.3)).data
        [bag] = (await call(client, "list_bags")).data
        numbers = [
            row["topic"]
            for row in (await call(client, "describe_bag", bag=bag)).data
            if row.get("type") == "std_msgs/Int32"
        ]
        plot = await call(client, "plot_bag", bag=bag, topic=numbers[0], parts=["data"])
        return rows[-1]["summary"], base64.b64decode(plot.pictures[0].data)

    environment = Environment(master_uri=ros.master_uri)
    with Node("planner", environment=environment) as planner, Node("lidar", environment=environment) as lidar:
        planner.subscribe("/scan", LaserScan, print)
        lidar.advertise("/front/scan", LaserScan)
        why, picture = run(over_stdio(ros), look)
    assert "/front/scan" in why
    assert picture.startswith(b"\x89PNG")


def test_approve_needs_a_terminal_and_takes_no_options(ros: RosSystem) -> None:
    ended = ros.pipros.run("pipros", "mcp", "approve")
    assert ended.returncode == 1
    assert ended.stderr == ["ERROR: pipros mcp approve must run in a terminal, because a human must answer"]
    assert ros.pipros.run("pipros", "mcp", "approve", "--http", "0").returncode == 2


def test_a_policy_that_is_wrong_ends_the_command(ros: RosSystem) -> None:
    (ros.home / "p.yaml").write_text("topics: {/x: {}}\n")
    ended = ros.pipros.run("pipros", "mcp", "--policy", "p.yaml")
    assert ended.returncode == 1
    assert "topics./x.type: is missing" in ended.stderr[-1]
