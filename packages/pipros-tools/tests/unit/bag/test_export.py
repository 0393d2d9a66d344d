import io
import struct
import sys
import zlib
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped, Vector3Stamped
from nav_msgs.msg import Path as PathMessage
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CompressedImage, Image, JointState, LaserScan, PointCloud2, PointField
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage

from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.time import Time
from pipros_libraries.pictures.codecs import codec
from pipros_tools.bag import BagError
from pipros_tools.bag.images import image_array_file, image_file
from pipros_tools.bag.options import FileOptions
from pipros_tools.bag.record_files import RecordFiles
from pipros_tools.cli.rosbag import main
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.bags import Row, bag_bytes

NAMES = ["a", "bc", *"e" * 60, "d" * 5000]
"""If all had the width of the longest, an array of these names would be large."""


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    rows: list[Any] = []
    for n in range(3):
        point = Vector3Stamped(header=Header(stamp=Time(n, 5), frame_id="a,b"))
        point.vector.x = n / 2
        rows.append(("/deep/point", point, n, 7))
        rows.append(("/joints", joints(n), n, 8))
    rows.append(("/camera", image("rgb8"), 9, 10))
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes(rows))
    return path


def joints(number: int) -> JointState:
    return JointState(name=["a", "bc"][:number], position=[1.0] * number, velocity=[float(number), 2.0])


def image(encoding: str, data: bytes = bytes(range(12)), **more: Any) -> Image:
    return Image(encoding=encoding, width=2, height=2, step=6, data=data, **more)


def pixels(png: bytes) -> bytes:
    """Return the rows of a PNG file, each after a zero; the files have the filter `Sub`."""
    width, _, bits, kind = struct.unpack(">IIBB", png[16:26])
    at = png.index(b"IDAT")
    (size,) = struct.unpack(">I", png[at - 4 : at])
    data = bytearray(zlib.decompress(png[at + 4 : at + 4 + size]))
    pixel = {0: 1, 2: 3, 6: 4}[kind] * bits // 8
    for start in range(0, len(data), 1 + width * pixel):
        assert data[start] == 1
        data[start] = 0
        for each in range(start + 1 + pixel, start + 1 + width * pixel):
            data[each] = (data[each] + data[each - pixel]) % 256
    return bytes(data)


def test_topics_become_tables_and_images(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "run.bag", "out"]) == 0

    assert (Path("out") / "deep__point.csv").read_text().splitlines() == [
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.vector.x,field.vector.y,field.vector.z",
        '7,0,5,"a,b",0.0,0.0,0.0',
        '1000000007,0,1000000005,"a,b",0.5,0.0,0.0',
        '2000000007,0,2000000005,"a,b",1.0,0.0,0.0',
    ]
    png = (Path("out") / "camera" / "9.000000010.png").read_bytes()
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    assert pixels(png) == b"\0\0\1\2\3\4\5\0\6\7\x08\x09\x0a\x0b"
    assert "/joints: 3 messages to out/joints.csv" in capsys.readouterr().out


@pytest.mark.skipif(sys.platform == "win32", reason="links")
def test_unfinished_files_follow_no_link_of_another_user(bag: Path) -> None:
    mine = bag.parent / "mine"
    mine.write_text("precious")
    (bag.parent / "out").mkdir()
    for name in ("new.bag", "new.mcap", "out/joints.csv", "rec.bag", "rec.mcap"):
        (bag.parent / f"{name}.active").symlink_to(mine)

    assert main(["filter", "run.bag", "new.bag", "True"]) == main(["export", "run.bag", "out"]) == 0
    assert main(["convert", "run.bag", "new.mcap"]) == 0
    for name in ("rec.bag", "rec.mcap"):
        recording = RecordFiles(FileOptions(name=name), print)
        recording.open(0)
        recording.close()

    assert (mine.read_text(), list(bag.parent.rglob("*.active"))) == ("precious", [])


def test_topics_become_arrays(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--format", "npz", "run.bag", "out", "/deep/point", "/joints"]) == 0

    with numpy.load("out/deep__point.npz") as found:
        assert found["vector.x"].tolist() == [0.0, 0.5, 1.0]
        assert found["header.stamp"].tolist() == [5, 1000000005, 2000000005]
        assert found["time"].tolist() == [7, 1000000007, 2000000007]
    with numpy.load("out/joints.npz") as found:
        assert found["velocity"].tolist() == [[0.0, 2.0], [1.0, 2.0], [2.0, 2.0]]
        offsets = found["position:offsets"].tolist()
        assert [found["position"][begin:end].tolist() for begin, end in pairwise(offsets)] == [
            [], [1], [1, 1]
        ]  # fmt: skip
        assert found["name"].tolist() == ["a", "a", "bc"]
        assert found["name:offsets"].tolist() == [0, 0, 1, 3]
        assert found["header.frame_id"].tolist() == [""] * 3
    assert capsys.readouterr().err == ""


def test_arrays_of_messages_become_an_array_for_each_field(bag: Path) -> None:
    moves = [TransformStamped(child_frame_id=name) for name in NAMES]
    clouds = [
        PointCloud2(fields=[PointField(name="x"), PointField(name="y", offset=4)], data=bytes(range(size)))
        for size in (8, 16, 0)
    ]
    rows: list[Any] = [("/tf", TFMessage(moves[:n]), n, 0) for n in (1, len(moves))]
    bag.write_bytes(bag_bytes([*rows, *(("/cloud", each, 5, 0) for each in clouds)]))

    assert main(["export", "--format", "npz", "run.bag", "out"]) == 0

    with numpy.load("out/tf.npz") as found:
        assert found["transforms:offsets"].tolist() == [0, 1, 1 + len(moves)]
        texts, at = found["transforms.child_frame_id"].tobytes(), found["transforms.child_frame_id:offsets"]
        assert [texts[begin:end] for begin, end in pairwise(at)] == [b"a", *map(str.encode, NAMES)]
        assert found["transforms.transform.rotation.w"].tolist() == [0.0] * (1 + len(moves))
    with numpy.load("out/cloud.npz") as found:
        assert found["data:offsets"].tolist() == [0, 8, 24, 24]
        assert found["data"].tolist() == [*range(8), *range(16)]
        assert found["fields.name"].tolist() == ["x", "y"] * 3


def test_a_field_with_the_name_time_is_kept(bag: Path) -> None:
    timed = message_classes_from_text("a/Timed", "float64 time")["a/Timed"]
    bag.write_bytes(bag_bytes([("/timed", timed(0.5), 7, 8)]))

    assert main(["export", "--format", "npz", "run.bag", "out"]) == 0

    with numpy.load("out/timed.npz") as found:
        assert {name: found[name].tolist() for name in found} == {"time": [0.5], "_time": [7_000_000_008]}


def test_samples_are_in_the_order_of_png() -> None:
    assert pixels(image_file(image("bgr8"))[1]) == b"\0\2\1\0\5\4\3\0\x08\7\6\x0b\x0a\x09"
    depth = image("16UC1", bytes(range(12)))
    assert pixels(image_file(depth)[1]) == b"\0\1\0\3\2\0\7\6\x09\x08"
    deep = Image(encoding="bgr16", width=1, height=1, step=6, data=b"\1\2\3\4\5\6")
    assert pixels(image_file(deep)[1]) == b"\0\6\5\4\3\2\1"
    assert pixels(image_file(image("8UC3"))[1]) == pixels(image_file(image("bgr8"))[1])
    jpeg = CompressedImage(data=b"\xff\xd8x", format="jpeg")
    assert image_file(jpeg) == (".jpg", b"\xff\xd8x")


@pytest.mark.parametrize(("wrong", "words"), [
    (image("yuv423"), r"Unrecognized image encoding \[yuv423\]"),
    (Image(encoding="mono8"), "the image is empty: 0 x 0 pixels"),
    (Image(encoding="32FC1"), "the image is empty: 0 x 0 pixels"),
    (CompressedImage(format="jpeg"), "the image is empty"),
    (CompressedImage(format="jpeg", data=b"no image"), "begins like no known format: 6e 6f 20"),
    (CompressedImage(format="16UC1; compressedDepth png", data=bytes(12)), "more than 12 bytes, got 12"),
    (image("rgb8", b"x"), "need 2 rows of 6 bytes, got 1 bytes in rows of 6"),
    (image("rgba8"), "need 2 rows of 8 bytes"),
])  # fmt: skip
def test_images_that_cannot_be_written_are_refused(wrong: Image, words: str) -> None:
    with pytest.raises(BagError, match=words):
        image_file(wrong)


def test_mistakes_are_explained(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "run.bag", "out", "/none"]) == 1
    assert "the bag does not contain the topics /none" in capsys.readouterr().err
    for arguments in (["run.bag"], ["--format", "xls", "run.bag", "out"]):
        with pytest.raises(SystemExit) as ended:
            main(["export", *arguments])
        assert ended.value.code == 2


def depth_image(encoding: str, values: Any, **more: Any) -> Image:
    array = numpy.atleast_2d(values)
    return Image(
        encoding=encoding, height=array.shape[0], width=array.shape[1], step=array.shape[1] * array.itemsize,
        data=array.tobytes(), **more,
    )  # fmt: skip


@pytest.mark.parametrize(("encoding", "dtype", "is_bigendian"), [
    ("32FC1", "<f4", 0), ("32FC1", ">f4", 1), ("16SC1", "<i2", 0), ("64FC1", "<f8", 0),
    ("32SC1", "<i4", 0), ("8SC1", "|i1", 0),
])  # fmt: skip
def test_pixels_that_png_cannot_store_become_arrays(encoding: str, dtype: str, is_bigendian: int) -> None:
    values = numpy.array([[1, 2, -3], [4, 5, 6]], dtype)

    suffix, content = image_file(depth_image(encoding, values, is_bigendian=is_bigendian))

    assert suffix == ".npy"
    found = numpy.load(io.BytesIO(content))
    assert (found.dtype, found.tolist()) == (numpy.dtype(dtype), values.tolist())


def test_arrays_have_no_padding_and_an_axis_for_channels() -> None:
    padded = Image(encoding="16SC2", width=1, height=2, step=5, data=b"\1\0\2\0#\3\0\4\0#")

    assert numpy.load(io.BytesIO(image_file(padded)[1])).tolist() == [[[1, 2]], [[3, 4]]]


GREEN = {"y": 145, "u": 54, "v": 34}


@pytest.mark.parametrize("encoding", ["yuv422", "yuv422_yuy2", "uyvy", "yuyv", "nv12", "nv21"])
@pytest.mark.parametrize("width", [4, 3])
def test_yuv_becomes_rgb(encoding: str, width: int) -> None:
    whole = (width + 1) // 2 * 2
    if encoding.startswith("nv"):
        pairs = "uv" if encoding == "nv12" else "vu"
        rows = "y" * whole * 2 + pairs * (whole // 2)
    else:
        rows = ("uyvy" if encoding in ("yuv422", "uyvy") else "yuyv") * (whole // 2) * 2
    data = bytes(GREEN[each] for each in rows)
    step = whole if encoding.startswith("nv") else 2 * whole

    suffix, content = image_file(Image(encoding=encoding, width=width, height=2, step=step, data=data))

    assert suffix == ".png"
    found = numpy.frombuffer(pixels(content), numpy.uint8).reshape(2, 1 + 3 * width)[:, 1:].reshape(-1, 3)
    assert (abs(found.astype(int) - [0, 255, 1]) <= 1).all()
    assert (
        numpy.load(
            io.BytesIO(
                image_array_file(Image(encoding=encoding, width=width, height=2, step=step, data=data))
            )
        ).dtype
        == numpy.uint8
    )


@pytest.mark.parametrize("height", [1, 2, 3, 4, 5, 7, 8])
@pytest.mark.parametrize("has_both_planes", [False, True])
def test_the_last_row_of_an_odd_nv12_image_has_its_own_colours(height: int, has_both_planes: bool) -> None:
    total = height + (height + 1) // 2
    data = bytes([GREEN["y"]] * 2 * height + [GREEN["u"], GREEN["v"]] * (total - height))
    shown = total if has_both_planes else height
    message = Image(encoding="nv12", width=2, height=shown, step=2, data=data)

    found = numpy.frombuffer(pixels(image_file(message)[1]), numpy.uint8).reshape(height, 7)[:, 1:]

    assert (abs(found.reshape(-1, 3).astype(int) - [0, 255, 1]) <= 1).all()
    with pytest.raises(BagError):
        image_file(Image(encoding="nv12", width=2, height=height, step=2, data=data[: 2 * height - 1]))


@pytest.mark.parametrize(("start", "suffix"), [
    (b"\xff\xd8\xff\xe0", ".jpg"), (b"\x89PNG\r\n\x1a\n", ".png"), (b"II*\0", ".tiff"),
    (b"MM\0*", ".tiff"), (b"BM6\0", ".bmp"), (b"RIFF\x24\0\0\0WEBP", ".webp"), (b"GIF89a", ".gif"),
])  # fmt: skip
def test_the_first_bytes_determine_the_suffix(start: bytes, suffix: str) -> None:
    message = CompressedImage(format="jpeg", data=start + bytes(20))

    assert image_file(message) == (suffix, start + bytes(20))


def test_a_topic_is_exported_to_no_device_of_windows(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.file_names.ON_WINDOWS", True)
    monkeypatch.chdir(tmp_path)
    Path("x.bag").write_bytes(
        bag_bytes([(topic, String("x"), 1, 0) for topic in ("/nul", "/nul_", "/a/nul")])
    )
    assert rosbag(["export", "x.bag", "out"]) == 0
    assert sorted(each.name for each in Path("out").iterdir()) == ["a__nul.csv", "nul_.csv", "nul__2.csv"]


def test_compressed_depths_are_exported_without_their_header() -> None:
    png = codec().encode(numpy.array([[1000, 65535]], numpy.uint16), "png", 1)
    message = CompressedImage(format="16UC1; compressedDepth png", data=bytes(12) + png)

    assert image_file(message) == (".png", png)
    assert numpy.load(io.BytesIO(image_array_file(message))).tolist() == [[1000, 65535]]


def test_compressed_depths_of_floats_become_metres() -> None:
    png = codec().encode(numpy.array([[0, 100]], numpy.uint16), "png", 1)
    header = struct.pack("<iff", 0, 250.0, -25.0)
    message = CompressedImage(format="32FC1; compressedDepth", data=header + png)

    suffix, content = image_file(message)

    assert suffix == ".npy"
    assert numpy.nan_to_num(numpy.load(io.BytesIO(content)), nan=-1).tolist() == [[-1, 2]]


def test_fields_may_have_the_names_of_numpys_parameters(bag: Path) -> None:
    text = "string file\nbool allow_pickle\nint32 args"
    log = message_classes_from_text("a_robot/Log", text)["a_robot/Log"]
    bag.write_bytes(bag_bytes([("/rosout", log(file="a.py", args=7), 1, 0)]))
    assert main(["export", "--format", "npz", "run.bag", "out"]) == 0
    with numpy.load("out/rosout.npz") as found:
        assert (found["file"].tolist(), found["args"].tolist()) == (["a.py"], [7])


def test_images_become_arrays_in_one_npz_file(bag: Path) -> None:
    png = codec().encode(numpy.array([[7]], numpy.uint8), "png", 1)
    rows: list[Any] = [
        ("/depth", depth_image("32FC1", numpy.float32([[0.5, 2]])), 1, 2),
        ("/depth", depth_image("32FC1", numpy.float32([[3]])), 1, 2),
        ("/grey", CompressedImage(format="png", data=png), 3, 0),
    ]
    Path("run.bag").write_bytes(bag_bytes(rows))

    assert main(["export", "--format", "npz", "run.bag", "out"]) == 0

    with numpy.load("out/depth.npz") as found:
        assert {name: found[name].tolist() for name in found} == {
            "1.000000002": [[0.5, 2]],
            "1.000000002_2": [[3]],
        }
    with numpy.load("out/grey.npz") as found:
        assert found["3.000000000"].tolist() == [[7]]


# `rosbag convert` to recordings of rerun, whose library a stand-in records.


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
        "/png": CompressedImage(format="png", data=b"\x89PNG"), "/cloud": cloud,
        "/scan": LaserScan(range_min=0.1, range_max=5, ranges=[1.0, 9.0], angle_increment=1.0), "/path": path,
        "/tf": TFMessage([transform]), "/rosout": Log(name="/node", msg="text"), "/text": String("hello"),
        "/joints": joints,
    }  # fmt: skip


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
        "EncodedImage", b"\x89PNG", "image/png"
    )  # fmt: skip
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


def test_without_the_library_the_error_says_what_to_install(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    (tmp_path / "run.bag").write_bytes(bag_bytes([("/text", String("hello"), 1, 0)]))
    assert rosbag(["convert", str(tmp_path / "run.bag"), str(tmp_path / "run.rrd")]) == 1
    assert "Try: pip install rerun-sdk" in capsys.readouterr().err
