"""Texts and names of peers on terminals, in logs, command lines and completion."""

import logging
import os
import re
import shutil
import signal
import socket
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from roscpp.srv import SetLoggerLevel

from pipros.net.master_client import MasterClient
from pipros.node.logger_services import serve_loggers
from pipros.wire.header import encode_header
from pipros_workspace.setup_files import SHELL_FOLDER
from tests.support.constants import Constants
from tests.support.nodes import MakeNode, listening_log
from tests.support.ros import RosSystem
from tests.support.terminal import EDITING_SHELLS, Terminal
from tests.support.waiting import wait_until

# Texts and names of peers on terminals and in logs: one line each, without escape sequences.


# Master and XML do not allow ESC, but the one-character CSI, line breaks and a bidi override.
HOSTILE = "\x9b31m\nforged line\u202e"
WRITTEN_OUT = r"\x9b31m\nforged line\u202e".replace(" ", "_")
HOSTILE_WRITTEN_OUT = r"\x9b31m\nforged line\u202e"
NAME = HOSTILE.replace(" ", "_")
API = "http://127.0.0.1:9/"
PLAIN = re.compile(r"[\t -~\xa1-\xac\xae-\xff]*")

NODE = """
import rospy
from std_msgs.msg import String
rospy.init_node("victim")
publisher = rospy.Publisher("/said", String, queue_size=1)
rospy.Subscriber("/heard", String, print)
rospy.spin()
"""

SPEAKER = r"""
import rospy
rospy.init_node("speaker")
rospy.loginfo("first\n2.000000000 FATAL /other [f:1(f)] [topics: ] forged\n\tindented \x1b]0;OWNED\x07\rend")
rospy.spin()
"""


class LyingNode(SimpleXMLRPCServer):
    """A node whose responses contain control characters."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), logRequests=False)
        self.api = f"http://127.0.0.1:{self.server_address[1]}/"
        self.register_function(lambda caller: [1, "", 4711], "getPid")
        self.register_function(self.bus_info, "getBusInfo")
        self.register_function(lambda *_: [0, HOSTILE, 0], "requestTopic")

    def bus_info(self, caller: str) -> list[Any]:
        return [1, "", [[1, HOSTILE, "i", HOSTILE, HOSTILE, True], [2], 3, [4, 5, [6], {}, 7]]]


@pytest.fixture
def lying_node() -> Iterator[LyingNode]:
    server = LyingNode()
    thread = Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def assert_plain(text: str) -> None:
    """Check that the output has only printable characters, and no line of a peer."""
    for line in text.split("\n"):
        assert PLAIN.fullmatch(line), repr(line)
        assert not line.startswith("forged")


def test_listings_escape_names(ros: RosSystem, lying_node: LyingNode) -> None:
    ros.pipros.start_master()
    peer = MasterClient(ros.master_uri, "/node" + NAME)
    peer.register_publisher("/topic" + NAME, "evil/Type" + NAME, lying_node.api)
    peer.register_service("/service" + NAME, "rosrpc://127.0.0.1:9/" + NAME, lying_node.api)
    peer.set_param("/param" + NAME, "value" + HOSTILE)
    other = MasterClient(ros.master_uri, "/other")
    other.register_subscriber("/plain_topic", "std_msgs/String", API + NAME)
    peer.register_publisher("/plain_topic", "std_msgs/String", lying_node.api)
    peer.close()
    other.close()
    shown = WRITTEN_OUT
    for line, expected in {
        "rosnode list": ["/node" + shown], "rosnode list -u": [API + shown],
        "rosnode list -a": ["/node" + shown, API + shown], "rosnode info -q /other": ["/plain_topic"],
        "rosnode machine": ["127.0.0.1"], "rosnode ping -a": ["/node" + shown],
        "rosnode cleanup": ["/other"], "rosnode kill": ["/node" + shown],
        "rostopic list": ["/topic" + shown, "/plain_topic"],
        "rostopic list -v": [f"/topic{shown} [evil/Type{shown}] 1 publisher"],
        "rostopic list --host": ["/topic" + shown],
        "rostopic info /plain_topic": [f" * /node{shown} ({lying_node.api})", f" * /other ({API}{shown})"],
        "rostopic find std_msgs/String": ["/plain_topic"], "rosservice list": ["/service" + shown],
        "rosservice list -n": [f"/service{shown} /node{shown}"], "rosservice find x/Y": [],
        "rosparam list": ["/param" + shown], "rosparam get -p /": [f"param{shown}:"],
        "rosparam dump": ["param"],
    }.items():  # fmt: skip
        ended = ros.pipros.run(*line.split())
        for text in expected:
            assert text in ended.output, (line, ended.output)
        lines = ended.output if line != "rosparam get -p /" else ended.output.replace("  forged", "")
        assert_plain(lines)
    output = ros.pipros.run("rosnode", "info", "/node" + NAME).output
    assert r"    * transport: \x9b31m\nforged line\u202e" in output
    assert "Traceback" not in output


def test_long_names_are_listed_whole(ros: RosSystem) -> None:
    ros.serve_master()
    client = MasterClient(ros.master_uri, "/n")
    client.register_publisher("/" + "t" * 500, "std_msgs/String", API)
    client.close()
    assert "/" + "t" * 500 in ros.pipros.run("rostopic", "list").stdout


def test_rows_of_echo_cannot_be_forged(ros: RosSystem) -> None:
    ros.serve_master()
    text = 'a,b "c"\n0,forged\x1b[31m'
    script = (
        "import rospy; from std_msgs.msg import String; rospy.init_node('p'); "
        f"p = rospy.Publisher('/said', String, latch=True, queue_size=1); p.publish({text!r}); rospy.spin()"
    )
    ros.pipros.start(sys.executable, "-c", script)
    ended = ros.pipros.run("rostopic", "echo", "-p", "-n1", "/said")
    assert len(ended.stdout) == 2
    assert ended.stdout[1].partition(",")[2] == r'"a,b ""c""\n0,forged\x1b[31m"'


def test_a_line_of_rosout_log_cannot_be_forged(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", SPEAKER)

    def logged() -> list[str]:
        return [
            line
            for file in (ros.home / ".ros" / "log").glob("*/rosout.log")
            if not file.parent.is_symlink()
            for line in file.read_text().split("\n")
            if "/speaker" in line or "forged" in line or "OWN" in line
        ]

    wait_until(lambda: any("rend" in line for line in logged()), 60, lambda: f"{logged()}")
    lines = logged()
    assert lines[-3].endswith("[topics: /rosout] first")
    assert lines[-2:] == [
        "\t2.000000000 FATAL /other [f:1(f)] [topics: ] forged", "\t\tindented \\x1b]0;OWNED\\x07\\rend",
    ]  # fmt: skip
    core.press_ctrl_c()


def test_texts_of_peers_are_one_line_of_a_log(ros: RosSystem, lying_node: LyingNode, tmp_path: Path) -> None:
    ros.serve_master()
    node = ros.pipros.start(sys.executable, "-c", NODE)
    ros.wait_for_subscriber("/heard")
    api = MasterClient(ros.master_uri, "/me").lookup_node("/victim")
    proxy: Any = ServerProxy(api)
    _, _, (_, host, port) = proxy.requestTopic("/me", "/said", [["TCPROS"]])
    header = {
        "topic": "/said", "callerid": "/evil\x1b]0;OWNED\x07\nforged", "md5sum": "0" * 32, "type": "x\ny",
    }  # fmt: skip
    with socket.create_connection((host, port)) as link:
        link.sendall(encode_header(header))
        assert link.recv(1000)
    node.wait_for(r"wants topic")
    peer = MasterClient(ros.master_uri, "/liar")
    peer.register_publisher("/heard", "std_msgs/String", lying_node.api)
    peer.close()
    node.wait_for(r"cannot receive \[/heard\]")
    proxy.shutdown("/evil" + HOSTILE, "reason" + HOSTILE)
    proxy("close")()
    node.wait()
    assert_plain(node.output)
    assert any("shutdown request: reason\\x9b31m\\nforged line\\u202e" in line for line in node.lines)
    for file in (ros.home / ".ros" / "log").glob("**/victim*.log"):
        assert_plain(file.read_text())


def test_messages_logged_by_users_keep_their_lines(ros: RosSystem) -> None:
    ros.serve_master()
    script = r"import rospy; rospy.init_node('n'); rospy.loginfo('one\ntwo\x1b[1m')"
    ended = ros.pipros.run(sys.executable, "-c", script)
    assert ended.stdout[0].endswith(": one")
    assert ended.stdout[1] == "two\x1b[1m"


FRAMES_AND_GOALS = """
import sys
import actionlib, rospy, tf2_ros
from actionlib.msg import TestAction
from geometry_msgs.msg import TransformStamped
rospy.init_node("teller")
hostile = sys.argv[1]
transforms = []
for parent, child in (("earth", hostile), (hostile, "moon"), ("sun", "mars" + hostile)):
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = parent
    transform.transform.rotation.w = 1
    transforms.append(transform)
broadcaster = tf2_ros.StaticTransformBroadcaster()
broadcaster.sendTransform(transforms)
server = actionlib.SimpleActionServer("/act", TestAction, auto_start=False)
server.register_goal_callback(lambda: server.accept_new_goal() and server.set_aborted(text=hostile))
server.start()
rospy.spin()
"""


def test_frames_results_and_servers_are_escaped(ros: RosSystem) -> None:
    ros.serve_master()
    peer = MasterClient(ros.master_uri, "/reconfigured")
    peer.register_service(f"/server{NAME}/set_parameters", "rosrpc://127.0.0.1:9/", API)
    peer.close()
    (ros.home / "teller.py").write_text(FRAMES_AND_GOALS)
    ros.pipros.start("python3", ros.home / "teller.py", HOSTILE)
    ros.wait_for_subscriber("/act/goal")

    listed = ros.pipros.run("rosrun", "dynamic_reconfigure", "dynparam", "list").output
    assert f"/server{WRITTEN_OUT}" in listed
    assert_plain(listed)
    (ros.home / "goal").write_text("goal: 1")
    client = ros.pipros.run("bash", "-c", f"rosrun actionlib_tools axclient.py /act < {ros.home}/goal").output
    assert f"ABORTED: {HOSTILE_WRITTEN_OUT}" in client
    assert_plain(client)
    monitor = ros.pipros.start("rosrun", "tf", "tf_monitor", "earth", "moon")
    monitor.wait_for(r"Chain is: .*->")
    echo = ros.pipros.start("rosrun", "tf", "tf_echo", "earth", "mars" + HOSTILE)
    echo.wait_for("Exception thrown")
    for program in (monitor, echo):
        program.send_signal(signal.SIGINT)
        program.wait()
        assert "forged" in program.output
        assert_plain(program.output)


# `~set_logger_level` does not let peers fill the memory of a node with loggers.


def level_of(name: str) -> int | None:
    """Return the level of a logger, None if it does not exist."""
    found = logging.Logger.manager.loggerDict.get(name)
    return found.level if isinstance(found, logging.Logger) else None


def test_peers_create_a_limited_number_of_loggers(make_node: MakeNode, constants: Constants) -> None:
    log, lines = listening_log()
    constants(LOGGERS=5)
    node = make_node("talker", log=log)
    serve_loggers(node)
    client = make_node("peer").client("/talker/set_logger_level", SetLoggerLevel, persistent=True)
    unique = f"x{uuid.uuid4().hex}"
    own = logging.getLogger(f"{unique}_own")
    names = [f"{unique}_{number}" for number in range(20)]
    for name in (*names, f"{unique}{'x' * 200}", own.name):
        client.call(SetLoggerLevel._request_class(logger=name, level="error"))
    client.close()

    assert [level_of(name) for name in names] == [logging.ERROR] * 5 + [None] * 15
    assert level_of(f"{unique}{'x' * 200}") is None
    assert own.level == logging.ERROR
    assert [line for line in lines if "the limit is 5" in line] == lines


def test_parts_of_names_count(make_node: MakeNode, constants: Constants) -> None:
    constants(LOGGERS=5)
    node = make_node("talker")
    serve_loggers(node)
    client = make_node("peer").client("/talker/set_logger_level", SetLoggerLevel, persistent=True)
    unique = f"x{uuid.uuid4().hex}"
    for name in (f"{unique}.a.b.c.d.e", f"{unique}_late"):
        client.call(SetLoggerLevel._request_class(logger=name, level="error"))
    client.close()

    assert level_of(f"{unique}.a.b.c.d.e") == logging.ERROR
    assert level_of(f"{unique}_late") is None


# TAB and Enter in real shells, with names of peers and files that contain shell syntax.


SHELLS = ["bash", "zsh", "fish"]
COMPLETION_HOSTILE = "$(touch${IFS}pwned)"


def open_shell(ros: RosSystem, program: str) -> Terminal:
    """A shell with the functions and completion of pipros."""
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    terminal = ros.pipros.open_terminal(EDITING_SHELLS[program])
    if program == "zsh":
        terminal.press("autoload -U compinit; compinit -D; cd\n")
    terminal.press(f"source {SHELL_FOLDER}/ros.{program}\n")
    return terminal


@pytest.mark.parametrize("program", SHELLS)
def test_a_name_with_shell_syntax_is_not_completed(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    peer = MasterClient(ros.master_uri, "/zz_evil_node" + COMPLETION_HOSTILE)
    peer.register_publisher("/zz_evil" + COMPLETION_HOSTILE, "std_msgs/String", API)
    peer.register_service("/zz_evil_service" + COMPLETION_HOSTILE, "rosrpc://127.0.0.1:9", API)
    peer.set_param("/zz_evil_param" + COMPLETION_HOSTILE, 1)
    MasterClient(ros.master_uri, "/n").register_publisher("/good_topic", "std_msgs/String", API)
    terminal = open_shell(ros, program)
    for line in ("rostopic type /zz", "rosnode info /zz", "rosservice uri /zz", "rosparam get /zz"):
        terminal.press(line + "\t\n")
        terminal.wait_for("(?i)unknown|cannot|not set")

    def completes() -> bool:
        """Completion offers nothing if the master does not answer at once, as on a busy machine."""
        terminal.press("rostopic type /goo\t\n")
        return "std_msgs" in terminal.wait_for(r"std_msgs/String|unknown topic type \[/goo")[0]

    wait_until(completes, 60)
    terminal.wait_for_prompt()
    assert not (ros.home / "pwned").exists()


@pytest.mark.parametrize("program", SHELLS)
def test_names_of_files_are_quoted(ros: RosSystem, program: str) -> None:
    package = ros.home / "src" / "robots"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / f"evil{COMPLETION_HOSTILE};touch pwned").write_text("innocent content\n")
    (package / "two words").write_text("of two words\n")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package.parent)
    terminal = open_shell(ros, program)
    for started, content in (("ev", "innocent content"), ("tw", "of two words")):
        terminal.press(f"roscat robots {started}\t\n")
        terminal.wait_for(content)
    terminal.wait_for_prompt()
    assert not (ros.home / "pwned").exists()


def test_names_with_line_breaks_are_not_offered(ros: RosSystem) -> None:
    package = ros.home / "src" / "robots"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robots</name></package>")
    (package / "one\ntwo").write_text("")
    (package / "one").write_text("")
    environment = {"ROS_PACKAGE_PATH": str(package.parent)}
    assert ros.pipros.run("pipros-complete", "2", "roscat", "robots", "o", **environment).stdout == ["one"]


# No token and no code is in a command line, which every user of the machine can read.


def command_lines() -> str:
    found = []
    for process in Path("/proc").iterdir():
        if process.name.isdigit():
            try:
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" "))
            except OSError:  # it has ended
                continue
    return os.fsdecode(b"\n".join(found))


@pytest.mark.parametrize("command", ["rqt_graph", "rviz", "rosrun turtlesim turtlesim_node"])
def test_the_browser_of_a_command_gets_no_secret_in_its_command_line(ros, tmp_path, command: str) -> None:
    opened, browser = tmp_path / "opened", tmp_path / "browser"
    copies = f'cp "${{1#file://}}" {opened}.part\nmv {opened}.part {opened}'
    browser.write_text(f"#!/bin/sh\n{copies}\nread line <{tmp_path}/fifo\n")
    browser.chmod(0o700)
    os.mkfifo(tmp_path / "fifo")  # the browser runs until it is killed
    ros.serve_master()
    ros.pipros.environment.update(BROWSER=f"{browser} %s", DISPLAY=":0", HOME=str(ros.home))
    program = ros.pipros.start(*command.split())
    token = program.wait_for(r"#token=([\w-]+)")[1]
    wait_until(opened.exists, 60, lambda: program.output)

    seen = command_lines()

    code = re.search(r"#code=([\w-]+)", opened.read_text())
    assert "/pipros-page-" in seen, "the browser has ended"
    assert code[1] not in seen
    assert token not in seen
    program.wait_for(f"paste this address into one: http://localhost:\\d+/#token={token}")
