"""rostopic pub to running subscribers."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from tests.support.nodes import Inbox, MakeNode
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.slaves import FakeSlave
from tests.support.waiting import wait_until

String = load_message_class("std_msgs/String")


@pytest.fixture
def inbox(make_node: MakeNode) -> Inbox:
    """The messages that a node receives on /words."""
    inbox = Inbox()
    make_node("listener").subscribe("/words", String, inbox)
    return inbox


def test_a_rate_repeats_the_message_until_ctrl_c(ros: RosSystem, master: Master, inbox: Inbox) -> None:
    pub = ros.pipros.start(
        "rostopic", "pub", "-r", "50", "/words", "std_msgs/String", "hello", ROS_MASTER_URI=master.uri
    )
    assert {message.data for message in inbox.wait(3)} == {"hello"}
    pub.press_ctrl_c()

    assert pub.wait() == 0
    assert pub.lines == []


def test_a_latched_message_reaches_later_subscribers(
    ros: RosSystem, master: Master, make_node: MakeNode
) -> None:
    pub = ros.pipros.start(
        "rostopic", "pub", "/words", "std_msgs/String", "data: hello", ROS_MASTER_URI=master.uri
    )
    pub.wait_for(r"publishing and latching message. Press ctrl-C to terminate")
    inbox = Inbox()
    make_node("late").subscribe("/words", String, inbox)
    assert inbox.wait()[0].data == "hello"
    pub.press_ctrl_c()

    assert pub.wait() == 0


@pytest.fixture
def waiting(ros: RosSystem, master: Master, make_node: MakeNode) -> Process:
    """Start a publisher that waits for messages from a pipe."""
    client = make_node("looker").master
    pub = ros.pipros.processes.start(
        *("rostopic", "pub", "/words", "std_msgs/String"),
        stdin=subprocess.PIPE,
        environment={"ROS_MASTER_URI": master.uri},
    )
    wait_until(lambda: "/words" in dict(client.get_system_state()[0]), what="a publisher")
    return pub


def test_ctrl_c_ends_it_while_it_waits_for_a_pipe(waiting: Process) -> None:
    waiting.press_ctrl_c()

    assert waiting.wait() == 0
    assert waiting.lines == []


def test_rosnode_kill_ends_it_while_it_waits_for_a_pipe(
    ros: RosSystem, master: Master, waiting: Process
) -> None:
    killed = ros.pipros.run("rosnode", "kill", "-a", ROS_MASTER_URI=master.uri)
    assert "killed" in killed.stdout

    assert waiting.wait() == 0
    assert waiting.lines == []


def test_every_document_of_a_pipe_is_a_message(ros: RosSystem, master: Master, inbox: Inbox) -> None:
    bash = shutil.which("bash")
    assert bash
    pipe = ros.pipros.run(
        bash,
        "-c",
        "printf 'data: one\\n---\\ndata: two\\n' | rostopic pub /words std_msgs/String",
        ROS_MASTER_URI=master.uri,
    )
    assert [message.data for message in inbox.wait(2)] == ["one", "two"]
    assert (pipe.returncode, pipe.stderr) == (0, [])


def test_every_document_of_a_file_is_a_message(
    ros: RosSystem, master: Master, inbox: Inbox, tmp_path: Path
) -> None:
    file = tmp_path / "words.yaml"
    file.write_text("data: one\n---\ndata: two\n---\n")
    pub = ros.pipros.run(
        "rostopic", "pub", "-r", "50", "-f", file, "/words", "std_msgs/String", ROS_MASTER_URI=master.uri
    )
    assert [message.data for message in inbox.wait(2)] == ["one", "two"]
    assert pub.returncode == 0


def test_now_is_the_time_of_each_message_with_substitution(
    ros: RosSystem, master: Master, make_node: MakeNode
) -> None:
    inbox = Inbox()
    make_node("listener").subscribe("/stamps", load_message_class("std_msgs/Time"), inbox)
    pub = ros.pipros.start(
        "rostopic", "pub", "-s", "-r", "50", "/stamps", "std_msgs/Time", "now", ROS_MASTER_URI=master.uri
    )
    first, second = inbox.wait(2)[:2]
    pub.press_ctrl_c()

    assert pub.wait() == 0
    assert first.data < second.data


def test_a_value_of_the_wrong_type_is_refused_before_anything_is_sent(ros: RosSystem, master: Master) -> None:
    pub = ros.pipros.run(
        "rostopic", "pub", "-1", "/number", "std_msgs/Int32", "hello", ROS_MASTER_URI=master.uri
    )
    assert pub.returncode == 1
    assert pub.stderr == ["ERROR: field data must be an integer type", "", "Args are: [data]"]


def test_a_subscriber_that_did_not_connect_is_named(ros: RosSystem, master: Master) -> None:
    slave = FakeSlave()  # it is notified, but does not connect
    lost = MasterClient(master.uri, "/base")
    lost.register_subscriber("/words", "std_msgs/String", slave.api)

    pub = ros.pipros.run(
        "rostopic", "pub", "-1", "/words", "std_msgs/String", "hello", ROS_MASTER_URI=master.uri
    )

    assert pub.returncode == 0
    (line,) = pub.stderr
    assert line.startswith("/base subscribes, but has not connected to this publisher.")
    assert "ROS_IP" in line
    lost.close()
    slave.stop()


def test_nothing_is_said_of_a_topic_without_subscribers(ros: RosSystem, master: Master) -> None:
    pub = ros.pipros.run(
        "rostopic", "pub", "-1", "/nobody", "std_msgs/String", "hello", ROS_MASTER_URI=master.uri
    )
    assert (pub.returncode, pub.stderr) == (0, [])
