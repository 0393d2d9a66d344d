"""Notebooks: displays, and nodes in cells that run again. `docs/notebook.ipynb` runs from a clean state."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import nbformat
import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Path as PathMessage
from sensor_msgs.msg import CompressedImage, Image, PointCloud2, PointField
from std_msgs.msg import Header, String

import rosbag
from pipros.data import open_bags
from pipros.msg.time import Time
from tests.support.bags import bag_bytes
from tests.support.notebook import NOTEBOOK, run_notebook
from tests.support.ros import RosSystem
from tf2_py import BufferCore

PICTURE = '<img src="data:image/'


def outputs(cell: Any) -> list[tuple[str, ...]]:
    """Return what kinds of output a cell has."""
    return [(each.output_type, *sorted(each.get("data", {}))) for each in cell.get("outputs", ())]


def test_the_notebook_of_the_documentation_runs_from_a_clean_state(tmp_path: Path) -> None:
    stored = nbformat.read(NOTEBOOK, as_version=4)
    found = run_notebook(tmp_path)
    assert [outputs(each) for each in found.cells] == [outputs(each) for each in stored.cells]
    shown = [
        each.data.get("text/html", "")
        for cell in found.cells
        for each in cell.get("outputs", ())
        if "data" in each
    ]
    assert PICTURE in shown[0]
    assert re.search(
        r"<caption>drive.bag .*<td>/odom</td><td>nav_msgs/Odometry</td><td>\d\d\d</td>", "".join(shown)
    )


CELLS = """\
import asyncio, rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse
assert asyncio.get_running_loop().is_running()

rospy.init_node("first")
received = []
subscriber = rospy.Subscriber("/chatter", String, received.append)
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
server = rospy.Service("/work", Trigger, lambda _: TriggerResponse(True, "done"))

rospy.init_node("first")
publisher.publish("hello")
assert rospy.wait_for_message("/chatter", String, 60).data == "hello"
assert rospy.ServiceProxy("/work", Trigger)().message == "done"

rospy.init_node("second")
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
publisher.publish("again")
print(rospy.get_name(), rospy.wait_for_message("/chatter", String, 60).data)

import os, signal, threading
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    rospy.spin()
    rospy.sleep(60)
except (KeyboardInterrupt, rospy.ROSInterruptException):
    pass

rospy.init_node("second")
publisher = rospy.Publisher("/chatter", String, latch=True, queue_size=1)
publisher.publish("after an interrupt")
print(rospy.wait_for_message("/chatter", String, 60).data)

from pipros import Node, load_message_class
with Node("third") as node:
    assert "/second" in [name for _, names in node.master.get_system_state()[0] for name in names]
rospy.signal_shutdown("the end")
"""


def test_a_node_survives_cells_that_run_again_also_with_another_name(
    ros: RosSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ros.serve_master()
    monkeypatch.setenv("ROS_MASTER_URI", ros.master_uri)
    cells = [nbformat.v4.new_code_cell(each) for each in CELLS.split("\n\n")]
    found = run_notebook(tmp_path, nbformat.v4.new_notebook(cells=cells))
    printed = "".join(
        each.text for cell in found.cells for each in cell.outputs if each.get("name") == "stdout"
    )
    assert printed == "/second again\nafter an interrupt\n"


def test_messages_are_tables_and_pictures() -> None:
    assert "<td>data</td><td>&lt;b&gt;</td>" in String("<b>")._repr_html_()
    header = Header(stamp=Time(5, 7), frame_id="x" * 1000)._repr_html_()
    assert "<td>stamp</td><td>5.000000007</td>" in header
    assert len(header) < 1000
    cloud = PointCloud2(height=1, width=9000, point_step=12, row_step=108_000, data=bytes(108_000))
    cloud.fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    path = PathMessage(poses=[PoseStamped() for _ in range(1000)])
    path.poses[-1].pose.position.x = 3.0
    image = Image(height=2, width=2, encoding="rgb8", step=6, data=bytes(12))
    for message in (cloud, path, image):
        text = message._repr_html_()
        assert PICTURE in text
        assert len(text) < 100_000
    assert "<td>data</td><td>108000 bytes</td>" in cloud._repr_html_()
    assert "<td>poses</td><td>… 1000 elements</td>" in path._repr_html_()
    for broken in (CompressedImage(data=b"no picture"), Image(height=9, width=9, encoding="rgb8")):
        assert PICTURE not in broken._repr_html_()


def test_transform_trees_are_indented() -> None:
    buffer = BufferCore()
    for parent, child in (("map", "<odom>"), ("<odom>", "base"), ("map", "camera")):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.transform.rotation.w = parent, 1.0
        buffer.set_transform_static(transform, "/node")
    names = re.findall(r"<tr><td>(.*?)</td>", buffer._repr_html_())
    space = "\N{NO-BREAK SPACE}" * 4
    assert names == ["map", f"{space}&lt;odom&gt;", f"{space * 2}base", f"{space}camera"]


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
