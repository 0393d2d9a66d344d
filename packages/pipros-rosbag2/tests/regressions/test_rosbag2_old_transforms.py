"""rosbags, rosbag2: bags before Hydro have tf/tfMessage, which no ROS 2 has; converted bags were useless."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Log
from tf2_msgs.msg import TFMessage

from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.bag import BagWriter
from pipros_tools.cli.rosbag import main
from tests.support.bags import header_of


@pytest.mark.parametrize("is_same", [True, False])
def test_renamed_types_get_their_later_names_if_they_are_the_same(
    is_same: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    transforms = TFMessage([TransformStamped(child_frame_id="laser")])
    messages: list[tuple[str, str, Any]] = [
        ("/tf", "tf/tfMessage", transforms),
        ("/rosout", "roslib/Log", Log(msg="x")),
    ]
    with open("old.bag", "w+b") as file:
        writer = BagWriter(file)
        for topic, name, message in messages:
            header = {**header_of(message, topic), "type": name.encode()}
            if not is_same:
                header["message_definition"] = b"int32 own"
                header["md5sum"] = b"1" * 32
            connection = writer.add_connection(topic, header)
            writer.write_message(connection, 1, 0, message)
        writer.finish()

    assert main(["convert", "--ros2", "humble", "old.bag", "new"]) == 0

    (path,) = Path("new").glob("*.db3")
    with closing(sqlite3.connect(path)) as database:
        found = dict(database.execute("SELECT name, type FROM topics"))
    if not is_same:
        assert not {"tf2_msgs/msg/TFMessage", "rcl_interfaces/msg/Log"} & set(found.values())
        return
    assert found == {"/tf": "tf2_msgs/msg/TFMessage", "/rosout": "rcl_interfaces/msg/Log"}
    with open_any_bag("new") as bag:
        by_topic = {topic: message for topic, message, *_ in bag.messages()}
    assert by_topic["/tf"].transforms[0].child_frame_id == "laser"
    assert by_topic["/rosout"].msg == "x"
