"""Bags and tables in notebooks, and columns of lists as arrays for plots."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

import rosbag
from pipros_data import open_bags
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
        "1", "2", "3", "4", "5", "26", "27", "28", "29", "30",
    ]  # fmt: skip
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


def test_lists_of_one_length_are_arrays_with_nan_in_gaps(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    texts = [("/text", String(str(n)), n, 0) for n in range(1, 5)]
    states = [("/joints", joints(n, n + 0.5), n, 0) for n in (2, 3)]
    path.write_bytes(
        bag_bytes([*texts, *states, ("/mixed", joints(1), 1, 0), ("/mixed", joints(1, 2), 2, 0)])
    )
    with open_bags(path) as bags:
        assert bags.table("/joints")["position"].to_numpy().tolist() == [[2, 2.5], [3, 3.5]]
        joined = bags.asof("/text", "/joints", tolerance=0.5)
        mixed = bags.table("/mixed")["position"]
    column = joined["joints.position"]
    nan = np.nan
    np.testing.assert_array_equal(np.asarray(column), [[nan, nan], [2, 2.5], [3, 3.5], [nan, nan]])
    assert [list(cell) for cell in joined["joints.name"]] == [[], *[["shoulder", "elbow"]] * 2, []]
    assert joined.to_arrow()["joints.position"].to_pylist() == [None, [2, 2.5], [3, 3.5], None]
    with pytest.raises(ValueError, match="nonempty cells must have the same size, got 1 to 2"):
        mixed.to_numpy()
    with pytest.raises(ValueError, match="must be arrays of numbers, got strings or messages"):
        np.asarray(joined["joints.name"])


def test_bursts_have_no_frequency(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    steady = [("/steady", String(), n, 0) for n in range(1, 31)]
    path.write_bytes(bag_bytes([*[("/burst", String(), 1, n) for n in range(5)], *steady]))
    with open_bags(path) as bags:
        text = bags._repr_html_()
    assert "/burst</td><td>std_msgs/String</td><td>5</td><td></td>" in text
    assert "/steady</td><td>std_msgs/String</td><td>30</td><td>1</td>" in text
