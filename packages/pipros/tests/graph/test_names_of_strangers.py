"""Nodes with topic names that every master refuses, for example from a bag."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32, String

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.node.registration import Registrations
from pipros.node.timings import NodeTimings
from pipros_tools.cli.command_node import command_node
from tests.support.bags import bag_bytes
from tests.support.nodes import MakeNode
from tests.support.ros import RosSystem


@pytest.mark.parametrize("topic", ["/a\x1b[31m\nb", "/a b", "", "/", "/a\xe9"])
def test_playing_an_illegal_topic_is_one_error(
    topic: str, ros: RosSystem, master: Master, tmp_path: Path
) -> None:
    path = tmp_path / "x.bag"
    path.write_bytes(bag_bytes([(topic, Int32(1), 1, 0), ("/b", Int32(1), 1, 0)]))
    done = ros.pipros.run("rosbag", "play", "-q", path, ROS_MASTER_URI=master.uri)

    shown = repr(topic)[1:-1].replace("\\xe9", "\xe9")
    assert done.returncode == 1
    assert done.output == f"ERROR: [{shown}] is not a legal topic name. Play other topics with --topics"
    done = ros.pipros.run("rosbag", "play", "-q", path, "--topics", "/b", ROS_MASTER_URI=master.uri)
    assert (done.returncode, done.output) == (0, "")


def test_a_name_that_cannot_be_encoded_is_reported_and_the_node_ends_properly(
    master: Master,
    make_node: MakeNode,
    caplog: pytest.LogCaptureFixture,
) -> None:
    node = make_node("talker", timings=NodeTimings(unregister_s=60.0))
    node.log.addHandler(caplog.handler)
    node.advertise("/good", String)
    node.advertise("/a\x1b", String)
    node.advertise("/last", String)

    assert "unable to register publication [/a\\x1b] with master" in caplog.text
    node.shutdown()
    client = MasterClient(master.uri, "/test")
    publishers, _, _ = client.call("getSystemState")
    assert publishers == []
    client.close()


def test_a_failing_shutdown_still_closes_the_loop(master: Master, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise, the loop would continue with a closed signal socket."""

    def fail(_: Any) -> None:
        raise RuntimeError("of the test")

    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    monkeypatch.setattr(Registrations, "close", fail)
    before = set(threading.enumerate())
    with pytest.raises(RuntimeError, match="of the test"), command_node("failing") as node:
        assert [thread for thread in threading.enumerate() if thread.name.endswith(node.name)]
    assert [
        thread.name for thread in set(threading.enumerate()) - before if thread.name.endswith(node.name)
    ] == []
