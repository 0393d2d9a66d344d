"""`rosbag convert` to recordings of rerun, whose library a stand-in records."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Path as PathMessage
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CompressedImage, Image, JointState, LaserScan, PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from pipros.msg.time import Time
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.bags import Row, bag_bytes


class Recording:
    """Stands in for `rerun.RecordingStream`."""

    def __init__(self, name: str, recording_id: str) -> None:
        self.names = (name, recording_id)
        self.logged: list[tuple[str, Any, dict[str, float]]] = []
        self.times: dict[str, float] = {}
        recordings.append(self)

    def save(self, path: str) -> None:
        self.path = Path(path)
        self.path.write_text("unfinished")

    def set_time(self, timeline: str, timestamp: float) -> None:
        self.times[timeline] = timestamp

    def log(self, path: str, found: Any) -> None:
        self.logged.append((path, found, dict(self.times)))

    def flush(self) -> None:
        self.path.write_text("flushed")

    def disconnect(self) -> None:
        self.path.write_text("complete")


recordings: list[Recording] = []


@pytest.fixture
def rerun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = ModuleType("rerun")
    module.RecordingStream = Recording
    for name in ("EncodedImage", "Points3D", "LineStrips3D", "TextLog", "Scalars", "Transform3D"):
        setattr(module, name, lambda *args, _name=name, **options: (_name, *args, options))
    monkeypatch.setitem(sys.modules, "rerun", module)
    monkeypatch.chdir(tmp_path)
    recordings.clear()


def messages() -> dict[str, Any]:
    transform = TransformStamped(child_frame_id="/base")
    transform.header.frame_id, transform.transform.rotation.w = "map", 1.0
    cloud = PointCloud2(height=1, width=2, point_step=12, row_step=24, data=struct.pack("<6f", *range(6)))
    cloud.fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    path = PathMessage(poses=[PoseStamped(), PoseStamped()])
    path.poses[1].pose.position.x = 2.0
    joints = JointState(name=["a"], position=[0.5])
    joints.header.stamp = Time(3, 500_000_000)
    return {
        "/image": Image(height=1, width=1, encoding="rgb8", step=3, data=b"\1\2\3"),
        "/broken": Image(height=9, width=9, encoding="rgb8"),
        "/jpeg": CompressedImage(format="jpeg", data=b"\xff\xd8jpeg"),
        "/png": CompressedImage(format="png", data=b"\x89PNG"),
        "/cloud": cloud,
        "/scan": LaserScan(range_min=0.1, range_max=5, ranges=[1.0, 9.0], angle_increment=1.0),
        "/path": path,
        "/tf": TFMessage([transform]),
        "/rosout": Log(name="/node", msg="text"),
        "/text": String("hello"),
        "/joints": joints,
    }


@pytest.mark.usefixtures("rerun")
def test_messages_become_the_kinds_of_rerun() -> None:
    rows: list[Row] = [(topic, message, 2, 250_000_000) for topic, message in messages().items()]
    Path("run.bag").write_bytes(bag_bytes(rows))
    assert (rosbag(["convert", "run.bag", "run.rrd"]), Path("run.rrd").read_text()) == (0, "complete")
    assert sorted(each.name for each in Path().iterdir()) == ["run.bag", "run.rrd"]
    (recording,) = recordings
    assert recording.names == ("pipros", "run")
    found = {path: kind for path, kind, _ in recording.logged}
    image = found.pop("image")
    assert (image[0], image[1]["contents"][:4], image[1]["media_type"]) == (
        "EncodedImage",
        b"\x89PNG",
        "image/png",
    )
    assert found == {
        "jpeg": ("EncodedImage", {"contents": b"\xff\xd8jpeg", "media_type": "image/jpeg"}),
        "png": ("EncodedImage", {"contents": b"\x89PNG", "media_type": "image/png"}),
        "cloud": ("Points3D", [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)], {}),
        "scan": ("Points3D", [(1.0, 0.0, 0.0)], {}),
        "path": ("LineStrips3D", [[(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)]], {}),
        "tf/base": (
            "Transform3D",
            {
                "translation": (0.0, 0.0, 0.0),
                "quaternion": (0.0, 0.0, 0.0, 1.0),
                "parent_frame": "map",
                "child_frame": "base",
            },
        ),
        "rosout": ("TextLog", "/node: text", {}),
        "text": ("TextLog", "hello", {}),
        "joints/position/0": ("Scalars", 0.5, {}),
    }
    times = {path: times for path, _, times in recording.logged}
    assert times["joints/position/0"] == {"receipt": 2.25, "header": 3.5}


@pytest.mark.usefixtures("rerun")
def test_a_damaged_bag_leaves_no_recording(capsys: pytest.CaptureFixture[str]) -> None:
    content = bag_bytes([("/text", String("hello"), 1, 0)])
    Path("run.bag").write_bytes(content.replace(b"\5\0\0\0hello", b"\xff\0\0\0hello"))
    assert rosbag(["convert", "run.bag", "run.rrd"]) == 1
    assert "ERROR converting run.bag" in capsys.readouterr().err
    assert [each.name for each in Path().iterdir()] == ["run.bag"]


def test_without_the_library_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    (tmp_path / "run.bag").write_bytes(bag_bytes([("/text", String("hello"), 1, 0)]))
    assert rosbag(["convert", str(tmp_path / "run.bag"), str(tmp_path / "run.rrd")]) == 1
    assert "Try: pip install rerun-sdk" in capsys.readouterr().err
