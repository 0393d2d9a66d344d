"""`pipros foxglove` and `pipros serve` as commands: options, tokens, TLS, and their end."""

import asyncio
import http.client
import json
import os
import signal
import ssl
import threading
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as connect_sync
from websockets.typing import Subprotocol

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros_bridges import serve
from pipros_bridges.foxglove.handler import SUBPROTOCOLS
from pipros_bridges.sessions import Handler
from tests.support.environments import file_of_tests
from tests.support.foxglove import Client, connected
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

CERTIFICATES = file_of_tests("support/certificates")
FOXGLOVE = Subprotocol(SUBPROTOCOLS[0])


@pytest.fixture
def token_file(tmp_path: Path) -> Path:
    file = tmp_path / "tokens"
    file.write_text("first-token-of-many # laptop\nsecond-token-of-many\n")
    file.chmod(0o600)
    return file


def test_a_foxglove_server_ends_with_ctrl_c(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "foxglove", "--port", "0")
    address = server.wait_for(r"ws://\S+")[0]
    server.wait_for("Clients can only read. With --control, they can also change the system.")
    with connected(address) as client:
        assert client.next("serverInfo")["name"] == "foxglove_bridge"
        server.press_ctrl_c()
        with pytest.raises(ConnectionClosed):
            client.until(lambda: False)
        assert server.wait() == 0
    assert server.stderr[-1].startswith("Clients can only read")


def test_the_foxglove_launch_file_limits_what_clients_publish_and_fetch(
    ros: RosSystem, tmp_path: Path
) -> None:
    ros.serve_master()
    names = {
        "port": "0", "client_topic_whitelist": "['/cmd.*']", "asset_uri_allowlist": "['package://mine/.*']"
    }  # fmt: skip
    unused = dict.fromkeys(("num_threads", "service_type_retrieval_timeout_ms", "use_compression"), "0")
    passed = "".join(f'<arg name="{name}" value="{value}"/>' for name, value in (names | unused).items())
    file = tmp_path / "robot.launch"
    bridge = "$(find foxglove_bridge)/launch/foxglove_bridge.launch"
    file.write_text(f'<launch><include file="{bridge}">{passed}</include></launch>')
    launch = ros.pipros.start("roslaunch", file)
    with connected(launch.wait_for(r"ws://\S+")[0]) as client:
        for number, topic in enumerate(("/other", "/cmd_vel")):
            channel = {"id": number, "topic": topic, "encoding": "json", "schemaName": "std_msgs/String"}
            client.send("advertise", channels=[channel])
        assert "does not allow topic [/other]" in client.next("status", level=2)["message"]
        client.send("fetchAsset", uri="package://rviz/default.rviz", requestId=1)
        assert b"asset_uri_allowlist does not allow [package://rviz/default.rviz]" in client.next_binary(4)
        wait_until(lambda: "/cmd_vel" in ros.pipros.run("rostopic", "list").stdout)


def test_the_node_ends_while_connections_and_protocols_end(master: Master) -> None:
    node = Node("bridge", environment=Environment(master_uri=master.uri))
    node_ends = threading.Event()
    outcome: list[bool] = []

    class Waiting:
        page = None

        def handlers(self) -> dict[str, Handler]:
            return {}

        def start(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)

        def close(self) -> None:
            outcome.append(node_ends.wait(20))

    node.on_shutdown(node_ends.set)
    assert serve.serve(node, serve.BridgeOptions("test", 0, closing_s=30.0), lambda *_: Waiting(), None) == 0
    assert outcome == [True]


def test_it_waits_for_a_master_that_is_not_there_yet(ros: RosSystem) -> None:
    server = ros.pipros.start("pipros", "foxglove", "--port", "0")
    with connected(server.wait_for(r"ws://\S+")[0]) as client:
        client.next("serverInfo")
        ros.serve_master()
        ros.pipros.start("rostopic", "pub", "-r", "10", "/chatter", "std_msgs/String", "data: hello")
        client.subscribe(1, "/chatter")
        assert client.next_message()[2] == b"\5\0\0\0hello"


def test_clients_need_a_token_of_the_file(ros: RosSystem, token_file: Path) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "foxglove", "--port", "0", "--token-file", token_file)
    address = server.wait_for(r"(ws://\S+)/TOKEN")[1]
    for token in ("first-token-of-many", "second-token-of-many"):
        with connected(f"{address}/{token}") as client:
            client.next("serverInfo")
    with connected(address) as client:
        client.socket.send(json.dumps({"token": "second-token-of-many"}))
        client.next("serverInfo")
    with connected(f"{address}/third-token-of-many") as client:
        client.socket.send("x")
        with pytest.raises(ConnectionClosed):
            client.receive()
    assert "token-of-many" not in server.output


@pytest.mark.parametrize(("options", "reason"), [
    (["--token-file", "missing"], "cannot read missing: No such file or directory"),
    (["--cert", "missing"], "cannot use the certificate missing"),
    (["--topic", "["], "[[] is not a regular expression"),
    (["--bind", "127.0.0.1:x"], "--bind must be HOST or HOST:PORT"),
    (["--bind", "127.0.0.1:²"], "--bind must be HOST or HOST:PORT"),
    (["--client-bytes", "0"], "--client-bytes must be > 0, got 0"),
    (["--bind", "192.0.2.1"], "cannot listen at 192.0.2.1:8765"),
])  # fmt: skip
def test_wrong_options_are_errors_of_one_line(ros: RosSystem, options: list[str], reason: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("pipros", "foxglove", *options)
    assert ended.returncode == 1
    assert ended.stderr[-1].startswith(f"ERROR: {reason}")


def test_a_certificate_encrypts_the_connection(ros: RosSystem) -> None:
    ros.serve_master()
    cert, key = CERTIFICATES / "cert.pem", CERTIFICATES / "key.pem"
    server = ros.pipros.start(
        "pipros", "foxglove", "--bind", "127.0.0.2", "--port", "0", "--cert", cert, "--key", key
    )
    address = server.wait_for(r"wss://\S+")[0].replace("localhost", "127.0.0.2")

    async def info() -> Any:
        trusting = ssl.create_default_context(cafile=str(cert))
        async with connect(address, subprotocols=[FOXGLOVE], ssl=trusting, proxy=None) as socket:
            return json.loads(await socket.recv())

    assert asyncio.run(info())["op"] == "serverInfo"
    listed = ros.pipros.run("pipros", "clients", address, "--cert", cert)
    assert listed.stdout == ["0 clients"]
    plain = ros.pipros.run("pipros", "clients", address.removeprefix("wss://"))
    assert "if it uses TLS, --cert FILE" in plain.stderr[-1]


def test_one_port_has_the_page_rosbridge_and_foxglove(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "-r", "10", "/chatter", "std_msgs/String", "data: hello")
    server = ros.pipros.start("pipros", "serve", "--port", "0")
    page = server.wait_for(r"http://(\S+)/#token=(\S+)")
    host, token = page[1], page[2]

    connection = http.client.HTTPConnection(host, timeout=30)
    connection.request("GET", "/")
    assert b"app.js" in connection.getresponse().read()
    with connect_sync(f"ws://{host}/live", origin=f"http://{host}", proxy=None) as browser:  # type: ignore[arg-type]
        browser.send(json.dumps({"token": token}))
        assert json.loads(browser.recv(timeout=30))["data"] == {"token": token}

    with connect_sync(f"ws://{host}", subprotocols=[FOXGLOVE], proxy=None) as socket:
        client = Client(socket)
        client.subscribe(1, "/chatter")
        assert client.next_message()[2] == b"\5\0\0\0hello"

        with connect_sync(f"ws://{host}", proxy=None) as rosbridge:
            rosbridge.send(json.dumps({"op": "subscribe", "topic": "/chatter"}))
            message = json.loads(rosbridge.recv(timeout=30))
            assert message == {"op": "publish", "topic": "/chatter", "msg": {"data": "hello"}}
            rosbridge.send(json.dumps({"op": "advertise", "topic": "/x", "type": "std_msgs/String"}))
            while message["op"] != "status":
                message = json.loads(rosbridge.recv(timeout=30))
            assert "read-only" in message["msg"]

        connection.request("GET", "/clients")
        assert connection.getresponse().status == 403
        connection.close()

        def rows() -> Any:
            connection.request("GET", "/clients", headers={"Authorization": f"Bearer {token}"})
            return json.loads(connection.getresponse().read())

        wait_until(lambda: len(rows()) == 1, what="the client of rosbridge to be forgotten")
        assert "/chatter" in rows()[0]["topics"]
        listed = ros.pipros.run("pipros", "clients", host, "--token", token)
        assert listed.stdout[0] == "1 client"
        assert "1: foxglove.sdk.v1 from 127.0.0.1" in listed.stdout[2]
        assert "receives /chatter" in listed.stdout[3]
    for place in (host, f"ws://{host}/", f"http://{host}/#token=x"):
        refused = ros.pipros.run("pipros", "clients", place)
        assert refused.returncode == 1
        assert refused.stderr[-1].startswith(f"ERROR: {host} requires a token; use --token-file FILE")
    server.press_ctrl_c()
    assert server.wait() == 0
    gone = ros.pipros.run("pipros", "clients", host)
    assert gone.stderr[-1].startswith(f"ERROR: no bridge responds at {host}")


def test_the_page_of_another_loopback_address_can_be_opened(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "serve", "--bind", "127.0.0.2:0")
    host = server.wait_for(r"http://(127\.0\.0\.2:\d+)/#token=")[1]

    connection = http.client.HTTPConnection(host, timeout=30)
    for name, status in {host: 200, host.replace("127.0.0.2", "other.example"): 403}.items():
        connection.request("GET", "/", headers={"Host": name})
        response = connection.getresponse()
        response.read()
        assert response.status == status
    connection.close()


def test_one_port_on_a_network_needs_the_token_that_it_prints(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "serve", "--bind", "0.0.0.0", "--port", "0")  # noqa: S104
    page = server.wait_for(r"http://localhost:(\d+)/#token=(\S+)")
    server.wait_for(rf"ws://0.0.0.0:{page[1]}/{page[2]}")
    address = f"ws://127.0.0.1:{page[1]}"
    with connected(f"{address}/{page[2]}") as client:
        client.next("serverInfo")
    with connected(address) as client:
        client.send("getParameters")
        with pytest.raises(ConnectionClosed):
            client.receive()
    with connect_sync(address, proxy=None) as rosbridge:
        rosbridge.send(json.dumps({"op": "subscribe", "topic": "/rosout"}))
        with pytest.raises(ConnectionClosed):
            rosbridge.recv(timeout=30)


@pytest.mark.parametrize("is_second", [False, True])
def test_rosapi_answers_through_the_one_port(ros: RosSystem, is_second: bool) -> None:
    ros.serve_master()
    if is_second:  # the first one leaves its registrations
        first = ros.pipros.start("pipros", "serve", "--port", "0")
        first.wait_for(r"http://(\S+)/#")
        wait_until(lambda: "/rosapi/topics" in ros.pipros.run("rosservice", "list").stdout)
        first.kill()
        first.wait()
    server = ros.pipros.start("pipros", "serve", "--port", "0")
    host = server.wait_for(r"http://(\S+)/#")[1]
    with connect_sync(f"ws://{host}", proxy=None) as rosbridge:
        message: dict[str, Any] = {}
        while not message.get("result"):
            rosbridge.send(json.dumps({"op": "call_service", "service": "/rosapi/nodes"}))
            message = json.loads(rosbridge.recv(timeout=30))
        assert "/rosapi" in message["values"]["nodes"]
        rosbridge.send(
            json.dumps(
                {"op": "call_service", "id": "set", "service": "/rosapi/set_param", "args": ["/x", "1"]}
            )
        )
        while message.get("id") != "set":
            message = json.loads(rosbridge.recv(timeout=30))
        assert message["result"] is False
    server.press_ctrl_c()
    assert server.wait() == 0
