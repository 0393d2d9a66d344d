"""Messages and transform trees in notebooks."""

# needs numpy
import re

from geometry_msgs.msg import Pose, PoseArray, PoseStamped, TransformStamped
from nav_msgs.msg import Path as PathMessage
from sensor_msgs.msg import CompressedImage, Image, PointCloud2, PointField
from std_msgs.msg import Float64MultiArray, Header, String

from pipros.msg.display import ROWS
from pipros.msg.time import Time
from tf2_py import BufferCore

PICTURE = '<img src="data:image/'


def test_messages_are_tables_and_pictures() -> None:
    assert ">data</td><td>&lt;b&gt;</td>" in String("<b>")._repr_html_()
    header = Header(stamp=Time(5, 7), frame_id="x" * 1000)._repr_html_()
    assert ">stamp</td><td>5.000000007</td>" in header
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
    assert ">data</td><td>108000 bytes</td>" in cloud._repr_html_()
    assert ">poses</td><td>… 1000 elements</td>" in path._repr_html_()
    for broken in (CompressedImage(data=b"no picture"), Image(height=9, width=9, encoding="rgb8")):
        assert PICTURE not in broken._repr_html_()


def test_large_messages_are_cut() -> None:
    numbers = Float64MultiArray(data=[0.5] * 1000)._repr_html_()
    assert f"<td>[{'0.5, ' * 10}… 1000 elements]</td>" in numbers
    poses = PoseArray(poses=[Pose() for _ in range(9)])
    path = PathMessage(poses=[PoseStamped() for _ in range(10)])
    assert poses._repr_html_().count("<tr>") < path._repr_html_().count("<tr>") <= ROWS + 2


def test_transform_trees_are_indented() -> None:
    buffer = BufferCore()
    for parent, child in (("map", "<odom>"), ("<odom>", "base"), ("map", "camera")):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.transform.rotation.w = parent, 1.0
        buffer.set_transform_static(transform, "/node")
    names = re.findall(r"<tr><td style=.text-align: left.>(.*?)</td>", buffer._repr_html_())
    space = "\N{NO-BREAK SPACE}" * 4
    assert names == ["map", f"{space}&lt;odom&gt;", f"{space * 2}base", f"{space}camera"]


def test_static_transforms_and_single_ones_have_no_rate() -> None:
    buffer = BufferCore()
    transform = TransformStamped(child_frame_id="laser")
    transform.header.frame_id, transform.transform.rotation.w = "base", 1.0
    buffer.set_transform_static(transform, "/node")
    transform.header.frame_id, transform.child_frame_id, transform.header.stamp = "odom", "base", Time(5)
    buffer.set_transform(transform, "/node")
    assert "base</td><td>/node</td><td></td><td>5.000</td>" in buffer._repr_html_()
    assert "laser</td><td>/node</td><td></td><td>static</td>" in buffer._repr_html_()
    transform.header.stamp = Time(7)
    buffer.set_transform(transform, "/node")
    assert "base</td><td>/node</td><td>1.0</td><td>7.000</td>" in buffer._repr_html_()
