"""rosbag, rostopic: a topic that was given twice was recorded twice, or counted at twice its rate."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

from std_msgs.msg import Int32

from pipros.master.master import Master
from pipros_tools.bag import BagReader
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.recorder import Recorder
from tests.support.bags import rows_of
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.ros import RosSystem


def test_each_message_is_recorded_once(make_node: MakeNode, tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    node, publisher = make_node("record"), make_node("talker").advertise("/number", Int32, queue_size=None)
    files = FileOptions(name=str(path))
    options = RecordOptions(topics=("/number", "number", "/number"), limit=4, files=files)
    said: list[Any] = []
    recording = threading.Thread(target=Recorder(node, options, say=said.append, warn=said.append).run)
    recording.start()
    wait_until_connected(publisher)
    for number in range(4):
        publisher.publish(Int32(number))
    recording.join(30)
    with BagReader(path) as bag:
        assert [row[:2] for row in rows_of(bag)] == [("/number", number) for number in range(4)]
    assert said.count("Subscribing to /number") == 1


def test_the_rate_is_that_of_the_topic(make_node: MakeNode, ros: RosSystem, master: Master) -> None:
    publisher = make_node("talker").advertise("/number", Int32)
    measuring = ros.pipros.start("rostopic", "hz", "/number", "number", ROS_MASTER_URI=master.uri)
    wait_until_connected(publisher)
    assert publisher.connection_count == 1
    measuring.press_ctrl_c()
    assert measuring.wait() == 0
    assert measuring.stdout.count("subscribed to [/number]") == 1
