"""Bags and tables in notebooks."""

from __future__ import annotations

import re
from pathlib import Path

from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

import rosbag
from pipros.data import open_bags
from tests.support.bags import bag_bytes


def test_bags_and_tables_show_topics_and_rows(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes([("/<text>", String(f"<{n}>"), n, 0) for n in range(1, 31)]))
    row = ">/&lt;text&gt;</td><td>std_msgs/String</td><td>30</td><td>1</td>"
    with rosbag.Bag(str(path)) as bag:
        assert row in bag._repr_html_()
    with open_bags(path) as bags:
        assert row in bags._repr_html_()
        table = bags.table("/<text>")
    text = table._repr_html_()
    assert "<th>_time</th><th>data</th>" in text
    assert re.findall(r"<td>&lt;(\d+)&gt;</td>", text) == [
        "1",
        "2",
        "3",
        "4",
        "5",
        "26",
        "27",
        "28",
        "29",
        "30",
    ]
    assert table.take(slice(0))._repr_html_().count("<tr>") == 1


def joints(*positions: float) -> JointState:
    return JointState(name=["shoulder", "elbow", "wrist", "hand"][: len(positions)], position=positions)


def test_arrays_and_texts_are_short(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    rows = [("/scan", LaserScan(ranges=[n + 0.123456 for n in range(360)]), 1, 0), ("/tf", TFMessage(), 1, 0)]
    path.write_bytes(bag_bytes([*rows, ("/two", joints(1, 2), 1, 0), ("/four", joints(1, 2, 3, 4), 1, 0)]))
    with open_bags(path) as bags:
        assert repr(bags) == f"<Bags of {path}: 4 topics>"
        shown = {topic: table._repr_html_().replace("\xa0", " ") for topic, table in bags.tables().items()}
    assert "<td>[0.123456 1.12346 ... 358.123 359.123]</td>" in shown["/scan"]
    assert "<td>[shoulder, elbow]</td><td>[1 2]</td>" in shown["/two"]
    assert "<td>[shoulder, elbow, wrist, … 4 cells]</td><td>[1 2 3 4]</td>" in shown["/four"]
    assert "<td>0 messages</td>" in shown["/tf"]
