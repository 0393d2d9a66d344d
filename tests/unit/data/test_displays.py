"""Bags and tables in notebooks."""

from __future__ import annotations

import re
from pathlib import Path

from std_msgs.msg import String

import rosbag
from pipros.data import open_bags
from tests.support.bags import bag_bytes


def test_bags_and_tables_show_topics_and_rows(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes([("/<text>", String(f"<{n}>"), n, 0) for n in range(1, 31)]))
    row = "<td>/&lt;text&gt;</td><td>std_msgs/String</td><td>30</td><td>1</td>"
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
