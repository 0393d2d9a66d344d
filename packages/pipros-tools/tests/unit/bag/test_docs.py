"""The Python examples of docs/guides/bags.md run, and its sizes are those of bags."""

import re
from io import BytesIO
from pathlib import Path

import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CompressedImage, Image, Imu, LaserScan, PointCloud2
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

import rosbag
import rospy
from pipros_tools.cli.rosbag.converting import convert
from tests.support import documents

DOCUMENT = documents.text_of("guides/bags.md")


def test_the_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    message = String("hello")
    for name in ("run.bag", "cut.bag", "a.bag", "b.bag"):
        with rosbag.Bag(name, "w") as bag:
            for second in range(1, 31):
                bag.write("/scan", message, rospy.Time(second))
    names: dict[str, object] = {"message": message, "seconds": 5, "nanoseconds": 6}
    assert convert(["b.bag", "b.mcap"]) == 0
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert len(examples) == 3

    for example in examples:
        exec(example, names)  # noqa: S102 # our own document

    with rosbag.Bag("new.bag") as bag:
        assert [(topic, m.data, str(t)) for topic, m, t in bag.read_messages()] == [
            ("/chatter", "hello", "5000000006")
        ]


HEADER = Header(frame_id="base_link")
TRANSFORM = TransformStamped(header=HEADER, child_frame_id="base_laser")
SCAN = LaserScan(header=HEADER, ranges=[1.0] * 720, intensities=[1.0] * 720)
IMAGE = Image(header=HEADER, encoding="rgb8", height=480, width=640, step=1920, data=bytes(480 * 1920))
RECORDED = {
    "`Imu`": (Imu(header=HEADER), 100),
    "`Odometry`": (Odometry(header=HEADER, child_frame_id="base_link"), 50),
    "`TFMessage`, 6 transforms": (TFMessage([TRANSFORM] * 6), 50),
    "`LaserScan`, 720 ranges and intensities": (SCAN, 10),
    "`CompressedImage`, JPEG": (CompressedImage(header=HEADER, format="jpeg", data=bytes(60_000)), 30),
    "`PointCloud2`, 30,000 points of 22 bytes": (PointCloud2(header=HEADER, data=bytes(22 * 30_000)), 10),
    "`Image`, 640 x 480, `rgb8`": (IMAGE, 30),
}


def test_the_table_of_sizes_is_computed_from_bags(tmp_path: Path) -> None:
    rows = ["| topic | bytes x rate | GB a day |", "| --- | ---: | ---: |"]
    for name, (message, rate_hz) in RECORDED.items():
        sizes = []
        for seconds in (1, 2):
            with rosbag.Bag(str(tmp_path / "some.bag"), "w") as bag:
                for number in range(seconds * rate_hz):
                    bag.write("/topic", message, rospy.Time.from_sec(1 + number / rate_hz))
            sizes.append((tmp_path / "some.bag").stat().st_size)
        content = BytesIO()
        message.serialize(content)
        gigabytes = (sizes[1] - sizes[0]) * 86_400 / 1e9
        a_day = f"{gigabytes:.1f}" if gigabytes < 10 else f"{float(format(gigabytes, '.3g')):,.0f}"
        rows.append(f"| {name} | {len(content.getvalue()):,} x {rate_hz} Hz | {a_day} |")
    assert "\n".join(rows) in DOCUMENT
