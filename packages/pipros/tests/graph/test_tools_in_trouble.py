"""Tools without a master, with a master that exits, with fast and large messages, and in background jobs."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import Unreachable
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros_tools.graph import loggers
from pipros_tools.graph.errors import GraphError
from pipros_tools.health import examine as examining
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
Log: Any = load_message_class("rosgraph_msgs/Log")
Bytes: Any = load_message_class("std_msgs/UInt8MultiArray")

EMPTY: Any = load_service_class("std_srvs/Empty")

NO_MASTER = "http://127.0.0.1:1"

WITHOUT_MASTER = [
    ("rostopic list", 1),
    ("rostopic list -v", 1),
    ("rostopic info /x", 1),
    ("rostopic type /x", 1),
    ("rostopic find std_msgs/String", 1),
    ("rostopic echo -n 1 /x", 1),
    ("rostopic hz /x", 1),
    ("rostopic bw /x", 1),
    ("rostopic delay /x", 1),
    ("rostopic pub -1 /x std_msgs/String a", 1),
    ("rosnode list", 1),
    ("rosnode info /x", 1),
    ("rosnode ping -c 1 /x", 1),
    ("rosnode ping -a", 1),
    ("rosnode machine", 1),
    ("rosnode kill -a", 1),
    ("rosnode cleanup", 1),
    ("rosparam list", 1),
    ("rosparam get /x", 1),
    ("rosparam set /x 1", 1),
    ("rosparam dump", 1),
    ("rosparam delete /x", 1),
    ("rosservice list", 2),
    ("rosservice call /x", 2),
    ("rosservice info /x", 2),
    ("rosservice find std_srvs/Empty", 2),
    ("rosconsole list /x", 1),
    ("rosconsole get /x y", 1),
    ("rosconsole set /x y info", 1),
    ("rosconsole echo", 1),
    ("rosgraph", 0),
]


@pytest.mark.parametrize(("line", "code"), WITHOUT_MASTER)
def test_without_a_master_a_tool_prints_one_line(
    line: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", NO_MASTER)
    command, *arguments = line.split()
    assert importlib.import_module(f"pipros_tools.cli.{command}").main(arguments) == code
    assert capsys.readouterr().err == "ERROR: Unable to communicate with master!\n"


def test_a_master_that_is_lost_during_the_examination_is_a_finding(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lose(uri: str, **_: Any) -> Any:
        raise Unreachable(uri, "Connection refused")

    monkeypatch.setattr(examining, "gather_system", lose)
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    rules = [finding.rule for finding in examining.examine(Environment(master_uri=master.uri)).findings]
    assert rules[-1:] == ["master-lost"]


@pytest.fixture
def system(ros: RosSystem) -> Iterator[tuple[Master, Node]]:
    """A master on the port of `ros`, in this process, and a node."""
    with Master(port=ros.port) as master:
        node = Node("source", environment=Environment(master_uri=master.uri))
        node.start()
        yield master, node
        node.shutdown("end of the test")


def test_a_tool_continues_without_the_master_and_ends_on_ctrl_c(
    ros: RosSystem, system: tuple[Master, Node]
) -> None:
    master, node = system
    text = node.advertise("/text", String, latch=True)
    log = node.advertise("/log", Log, latch=True)
    text.publish(String("before"))
    log.publish(Log(level=16, name="/source", msg="before"))
    tools = [
        ros.pipros.start("rostopic", "echo", "/text"),
        ros.pipros.start("rosconsole", "echo", "--topic", "/log"),
    ]
    for tool in tools:
        tool.wait_for("before")
    master.stop()
    text.publish(String("after"))
    log.publish(Log(level=16, name="/source", msg="after"))
    for tool in tools:
        tool.wait_for("after")
        tool.press_ctrl_c()
    for tool in tools:
        assert tool.wait() == 0
        assert "Traceback" not in tool.output


def test_tools_that_measure_and_publish_continue_without_the_master(
    ros: RosSystem, system: tuple[Master, Node]
) -> None:
    master, node = system
    ticks = node.advertise("/ticks", String)
    heard: list[Any] = []
    node.subscribe("/spoken", String, heard.append)
    with repeating(lambda: ticks.publish(String("x")), 0.02):
        measuring = [ros.pipros.start("rostopic", name, "/ticks") for name in ("hz", "bw")]
        speaking = ros.pipros.start("rostopic", "pub", "-r", "50", "/spoken", "std_msgs/String", "x")
        for tool in measuring:
            tool.wait_for("average", 60.0)
        wait_until(lambda: heard, 60.0, "a message")
        master.stop()
        heard.clear()
        seen = [tool.output.count("average") for tool in measuring]
        for tool, count in zip(measuring, seen, strict=True):
            wait_until(lambda tool=tool, count=count: tool.output.count("average") > count, 60.0, "measures")
        wait_until(lambda: heard, 60.0, "a message")
        for tool in (*measuring, speaking):
            tool.press_ctrl_c()
        for tool in (*measuring, speaking):
            assert tool.wait() == 0
            assert "Traceback" not in tool.output


def test_a_background_job_ends_on_sigint(ros: RosSystem, system: tuple[Master, Node]) -> None:
    shell = ros.pipros.start(
        "sh", "-c", "rosconsole echo --topic /quiet & echo job $!; wait $!; echo code $?"
    )
    job = int(shell.wait_for(r"^job (\d+)$")[1])
    ros.wait_for_subscriber("/quiet")
    os.kill(job, signal.SIGINT)
    shell.wait_for("^code 0$")


@contextlib.contextmanager
def repeating(action: Callable[[], object], pause_s: float) -> Iterator[None]:
    """Repeat an action in a thread until the block ends."""
    is_over = threading.Event()

    def repeat() -> None:
        while not is_over.wait(pause_s):
            action()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


def test_a_topic_of_ten_thousand_messages_a_second_is_measured_and_shown(
    ros: RosSystem, system: tuple[Master, Node]
) -> None:
    _, node = system
    quick = node.advertise("/quick", String)

    def burst() -> None:
        for _ in range(100):
            quick.publish(String("x"))

    with repeating(burst, 0.01):
        hz = ros.pipros.start("rostopic", "hz", "/quick")
        hz.wait_for(r"average rate: \d{3,}", 60.0)
        echo = ros.pipros.run("rostopic", "echo", "-n", "2000", "/quick", timeout_s=60.0)
        hz.press_ctrl_c()
        assert hz.wait() == 0
    assert echo.stdout == ['data: "x"', "---"] * 2000
    assert echo.returncode == 0


def test_a_message_of_eight_megabytes_is_measured_and_shown(
    ros: RosSystem, system: tuple[Master, Node]
) -> None:
    _, node = system
    large = node.advertise("/large", Bytes, latch=True)
    message = Bytes(data=bytes(8_000_000))
    large.publish(message)
    echo = ros.pipros.run("rostopic", "echo", "-n", "1", "--noarr", "/large")
    assert echo.stdout[-2:] == ['data: "<array type: uint8, length: 8000000>"', "---"]
    offset = ros.pipros.run("rostopic", "echo", "-n", "1", "/large/layout/data_offset")
    assert offset.stdout == ["0", "---"]
    with repeating(lambda: large.publish(message), 0.2):
        bw = ros.pipros.start("rostopic", "bw", "/large")
        bw.wait_for("mean: 8.00MB", 60.0)
        bw.press_ctrl_c()
    assert bw.wait() == 0


def test_a_topic_of_another_type_is_refused_as_a_log(ros: RosSystem, system: tuple[Master, Node]) -> None:
    _, node = system
    node.advertise("/text", String, latch=True).publish(String("x"))
    done = ros.pipros.run("rosconsole", "echo", "--topic", "/text")
    assert done.returncode == 1
    assert done.stderr == ["ERROR: topic [/text] must be of type rosgraph_msgs/Log, got [std_msgs/String]"]


def test_a_hung_node_does_not_block_rosconsole(ros: RosSystem, system: tuple[Master, Node]) -> None:
    _, node = system
    is_over = threading.Event()
    service: Any = load_service_class("roscpp/GetLoggers")
    node.serve("/stuck/get_loggers", service, lambda _: is_over.wait(60) or service._response_class())
    client = MasterClient(ros.master_uri, "/test")
    try:
        with pytest.raises(GraphError, match="get_loggers"):
            loggers.levels_of(client, "/stuck", limit_s=0.2)
    finally:
        is_over.set()
        client.close()


def test_rosservice_call_suggests_similar_names(ros: RosSystem) -> None:
    ros.serve_master()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        robot.serve("/reset_odometry", EMPTY, lambda _: EMPTY._response_class())
        mistyped = ros.pipros.run("rosservice", "call", "/reset_odometri")
        other = ros.pipros.run("rosservice", "call", "/x")
    assert mistyped.stderr == [
        "ERROR: Service [/reset_odometri] is not available.",
        "Did you mean /reset_odometry?",
    ]
    assert other.stderr == ["ERROR: Service [/x] is not available."]
