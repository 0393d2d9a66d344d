"""Tools without a master or output, with a master that exits, on terminals, and without POSIX."""

import contextlib
import importlib
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rosgraph_msgs.msg import Log
from std_msgs.msg import String, UInt8MultiArray
from std_srvs.srv import Empty

from pipros.basics.env import Environment
from pipros.basics.errors import Unreachable
from pipros.master.master import Master
from pipros.msg import load_service_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros_tools.graph import loggers
from pipros_tools.graph.errors import GraphError
from pipros_tools.health import examine as examining
from tests.support.nodes import MakeNode
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until
from tests.support.without_posix import run_without_posix

# Tools without a master, with a master that exits, with fast and large messages, and in background jobs.


NO_MASTER = "http://127.0.0.1:1"

WITHOUT_MASTER = [
    ("rostopic list", 1), ("rostopic list -v", 1), ("rostopic info /x", 1), ("rostopic type /x", 1),
    ("rostopic find std_msgs/String", 1), ("rostopic echo -n 1 /x", 1), ("rostopic hz /x", 1),
    ("rostopic bw /x", 1), ("rostopic delay /x", 1), ("rostopic pub -1 /x std_msgs/String a", 1),
    ("rosnode list", 1), ("rosnode info /x", 1), ("rosnode ping -c 1 /x", 1), ("rosnode ping -a", 1),
    ("rosnode machine", 1), ("rosnode kill -a", 1), ("rosnode cleanup", 1), ("rosparam list", 1),
    ("rosparam get /x", 1), ("rosparam set /x 1", 1), ("rosparam dump", 1), ("rosparam delete /x", 1),
    ("rosservice list", 2), ("rosservice call /x", 2), ("rosservice info /x", 2),
    ("rosservice find std_srvs/Empty", 2), ("rosconsole list /x", 1), ("rosconsole get /x y", 1),
    ("rosconsole set /x y info", 1), ("rosconsole echo", 1), ("rosgraph", 0),
]  # fmt: skip


@pytest.mark.parametrize(("line", "code"), WITHOUT_MASTER)
def test_without_a_master_a_tool_prints_one_line(line: str, code: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", NO_MASTER)
    command, *arguments = line.split()
    assert importlib.import_module(f"pipros_tools.cli.{command}").main(arguments) == code
    assert capsys.readouterr().err == "ERROR: Unable to communicate with master!\n"


def test_a_master_lost_during_the_examination_is_a_finding(master: Master, monkeypatch) -> None:
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


def test_tools_outlive_their_master_and_end_on_ctrl_c(ros: RosSystem, system: tuple[Master, Node]) -> None:
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
        tool.check(0)


def test_measuring_and_publishing_tools_outlive_the_master(ros, system: tuple[Master, Node]) -> None:
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
            tool.check(0)


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


def test_a_topic_of_ten_thousand_messages_a_second_is_measured_and_shown(ros, system) -> None:
    _, node = system
    quick = node.advertise("/quick", String)

    def burst() -> None:
        for _ in range(100):
            quick.publish(String("x"))

    with repeating(burst, 0.01):
        hz = ros.pipros.start("rostopic", "hz", "/quick")
        hz.wait_for(r"average rate: \d{3,}", 60.0)
        echo = ros.pipros.run("rostopic", "echo", "-n", "2000", "/quick", timeout_s=60.0)
        hz.press_ctrl_c(code=0)
    assert (echo.stdout, echo.returncode) == (['data: "x"', "---"] * 2000, 0)


def test_a_message_of_8_megabytes_is_measured_and_shown(ros: RosSystem, system: tuple[Master, Node]) -> None:
    _, node = system
    large = node.advertise("/large", UInt8MultiArray, latch=True)
    message = UInt8MultiArray(data=bytes(8_000_000))
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
    with ros.node("robot") as robot:
        robot.serve("/reset_odometry", Empty, lambda _: Empty._response_class())
        mistyped = ros.pipros.run("rosservice", "call", "/reset_odometri")
        other = ros.pipros.run("rosservice", "call", "/x")
    assert mistyped.stderr == [
        "ERROR: Service [/reset_odometri] is not available.", "Did you mean /reset_odometry?",
    ]  # fmt: skip
    assert other.stderr == ["ERROR: Service [/x] is not available."]


# Commands and nodes whose standard output is closed, full, or has a limited encoding.


COMMANDS = [
    "rosnode list", "rosnode info /rosout", "rostopic list", "rosservice list", "rosparam get /run_id",
    "rospack list", "rosmsg list", "rosversion -d", "rostopic --help",
]  # fmt: skip

NODE = """
import sys, rospy
from std_msgs.msg import String
rospy.init_node("speaker")
publisher = rospy.Publisher("/said", String, latch=True, queue_size=1)
for number in range(3):
    rospy.loginfo("line %d", number)
    print("printed", number, flush=sys.argv[1] == "flush")
publisher.publish("still here")
rospy.spin()
"""

LOGGING_NODE = """
import rospy
rospy.init_node("n")
rospy.loginfo("one")
rospy.logwarn("caf\\xe9")
rospy.loginfo("two")
"""


def shell(ros: RosSystem, script: str, **variables: str) -> Process:
    return ros.pipros.run("bash", "-c", script, **variables)


@pytest.mark.parametrize("command", ["rosmsg list", "rosmsg show -r sensor_msgs/PointCloud2", "rospack list"])
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_a_command_ends_quietly_when_the_pipe_closes(ros: RosSystem, command: str, is_buffered: str) -> None:
    script = f"{command} 2>errors | head -n 1 >/dev/null; echo ${{PIPESTATUS[0]}}; cat errors"
    assert shell(ros, script, PYTHONUNBUFFERED=is_buffered).stdout == ["0"]


@pytest.mark.parametrize("program", ["tf tf_echo a b 50", "tf tf_monitor"])
def test_a_program_of_a_package_ends_quietly_when_the_pipe_closes(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    script = f"rosrun {program} 2>errors | head -n 1 >/dev/null; echo ${{PIPESTATUS[0]}}; cat errors"
    assert shell(ros, script).stdout == ["0"]


@pytest.mark.timeout(300)
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_a_command_without_a_standard_output_succeeds_silently(ros: RosSystem, is_buffered: str) -> None:
    ros.pipros.start_master()
    for command in COMMANDS:
        closed = shell(ros, f"{command} >&-", PYTHONUNBUFFERED=is_buffered)
        usual = shell(ros, f"{command} >/dev/null", PYTHONUNBUFFERED=is_buffered)
        assert (closed.returncode, closed.lines) == (usual.returncode, []), command


@pytest.mark.timeout(300)
@pytest.mark.parametrize("is_buffered", ["", "1"])
def test_output_that_cannot_be_written_is_one_line_and_pythons_code(ros: RosSystem, is_buffered: str) -> None:
    ros.pipros.start_master()
    for command in COMMANDS:
        ended = shell(ros, f"{command} >/dev/full", PYTHONUNBUFFERED=is_buffered)
        lines = ["ERROR: cannot write to standard output: No space left on device"]
        assert (ended.returncode, ended.lines) == (120, lines), command


def test_rostopic_echo_ends_when_its_messages_cannot_be_written(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "/said", "std_msgs/String", "x")
    ended = shell(ros, "rostopic echo /said >/dev/full")
    assert ended.returncode == 120
    assert ended.lines[-1] == "ERROR: cannot write to standard output: No space left on device"


def test_all_standard_streams_may_be_closed(ros: RosSystem) -> None:
    ros.serve_master()
    assert shell(ros, "rosnode list <&- >&- 2>&-").returncode == 0
    assert shell(ros, "rosnode info /nobody <&- >&- 2>&-").returncode == 0
    ended = shell(ros, "rosparam set /x 1 <&- >&-; rosparam get /x")
    assert ended.stdout == ["1"]


@pytest.mark.parametrize(("to", "how"), [(">&-", "flush"), (">&-", "keep"), (">/dev/full", "keep")])
def test_a_node_continues_without_standard_output(ros: RosSystem, tmp_path: Path, to: str, how: str) -> None:
    ros.serve_master()
    (tmp_path / "speaker.py").write_text(NODE)
    node = ros.pipros.start("bash", "-c", f"exec {sys.executable} speaker.py {how} {to}", PYTHONUNBUFFERED="")
    heard = ros.pipros.run("rostopic", "echo", "-n1", "/said")
    assert heard.stdout[0] == 'data: "still here"'
    assert node.is_running
    node.press_ctrl_c()
    node.wait()


def test_roslaunch_runs_its_nodes_when_its_output_is_lost(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "param.launch").write_text('<launch><param name="done" value="1"/></launch>')
    ros.serve_master()
    for to in (">&-", ">/dev/full"):
        ended = shell(
            ros, f"rosparam delete /done 2>/dev/null; roslaunch param.launch {to}; rosparam get /done"
        )
        assert "1" in ended.stdout, ended.output
        assert "Traceback" not in ended.output


def test_characters_that_the_encoding_does_not_have_are_escaped(ros: RosSystem, tmp_path: Path) -> None:
    ros.serve_master()
    ros.pipros.run("rosparam", "set", "/street", "Straße")
    ended = ros.pipros.run("rosparam", "get", "-p", "/street", PYTHONIOENCODING="ascii")
    assert (ended.returncode, ended.stdout) == (0, ["Stra\\xdfe"])
    ended = ros.pipros.run(sys.executable, "-c", LOGGING_NODE, PYTHONIOENCODING="ascii")
    assert [line.partition("]: ")[2] for line in ended.stdout] == ["one", "two"]
    assert "caf\\xe9" in ended.stderr[0]
    (tmp_path / "é.launch").write_text('<launch><param name="é" value="ü"/></launch>')
    ended = ros.pipros.run("roslaunch", "--dump-params", "é.launch", PYTHONIOENCODING="ascii")
    assert "Traceback" not in ended.output


# Tools on a terminal: alignment, colours, and tables that are redrawn in place. Output to pipes is plain.


@pytest.fixture
def terminal(ros: RosSystem, master: Master) -> Terminal:
    ros.pipros.environment.update(ROS_MASTER_URI=master.uri, TERM="xterm")
    ros.pipros.environment.pop("NO_COLOR", None)
    return ros.pipros.open_terminal()


def test_lists_are_aligned_and_coloured_outside_pipes(ros, terminal: Terminal, make_node: MakeNode) -> None:
    make_node("talker").advertise("/a_long_name", String)

    _, coloured = terminal.run("rostopic list -v")
    _, plain = terminal.run("NO_COLOR=1 rostopic list -v")
    piped = ros.pipros.run("rostopic", "list", "-v")

    assert re.search(
        r" \* /a_long_name +\x1b\[36m\[std_msgs/String\] *\x1b\[0m \x1b\[2m1 publisher\x1b", coloured
    )
    assert re.search(r" \* /a_long_name +\[std_msgs/String\] +1 publisher\n", plain)
    assert " * /a_long_name [std_msgs/String] 1 publisher" in piped.stdout
    assert "\x1b" not in piped.output


@pytest.mark.parametrize(
    ("command", "heading"), [("hz", "topic +rate +min_delta"), ("bw", "topic +average +mean")]
)
def test_figures_of_several_topics_are_shown_in_place(terminal, make_node, command, heading: str) -> None:
    node = make_node("talker")
    publishers = [node.advertise(topic, String, queue_size=10) for topic in ("/a", "/b")]
    replaced = re.compile(rf"\x1b\[\d+A\x1b\[J *{heading}")

    def publish_until_replaced() -> bool:
        for publisher in publishers:
            publisher.publish(String("hello"))
        return replaced.search(terminal.output) is not None

    terminal.type(f"rostopic {command} /a /b")
    wait_until(publish_until_replaced, timeout_s=60)
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0


# A graph on a system without the modules and functions of POSIX, such as Windows.


GRAPH = """
import os, threading
from pipros_tools.cli import rosmsg, rosnode, rosparam, rosservice, rostopic
from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from std_msgs.msg import String

with Master(port=0) as master, Node("node", environment=Environment(master_uri=master.uri)) as node:
    arrived = threading.Event()
    node.subscribe("/chat", String, lambda message: arrived.set())
    node.advertise("/chat", String, latch=True).publish(String("x"))
    assert arrived.wait(30)
    os.environ["ROS_MASTER_URI"] = master.uri
    for command, arguments in (
        (rostopic, ["list"]),
        (rosnode, ["list"]),
        (rosservice, ["list"]),
        (rosparam, ["set", "/speed", "5"]),
        (rosparam, ["get", "/speed"]),
        (rosmsg, ["show", "std_msgs/String"]),
    ):
        assert command.main(arguments) == 0
"""


def test_nodes_and_queries_work_without_posix() -> None:
    shown = run_without_posix(GRAPH).split()
    assert (shown[:2], shown[-3:]) == (["/chat", "/node"], ["5", "string", "data"])
