"""Bags and tables in notebooks, and columns of lists as arrays for plots."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image, JointState, LaserScan, PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

import rosbag
from pipros_data import open_bags
from pipros_libraries.pictures.errors import PictureError
from tests.support.bags import Row, bag_bytes


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


# Images and point clouds as columns that are decoded when they are accessed.


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(name: str, rows: list[Row]) -> str:
    Path(name).write_bytes(bag_bytes(rows))
    return name


def picture() -> Iterator[Row]:
    pixels = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    padded = b"".join(line.tobytes() + b"pad" for line in pixels)
    yield "/raw", Image(height=2, width=3, encoding="rgb8", step=12, data=padded), 1, 0
    yield "/raw", Image(height=2, width=3, encoding="rgb8", step=12, data=padded[:-1]), 2, 0
    depth = np.array([[1, 2], [3, 4]], ">u2")
    image = Image(height=2, width=2, encoding="16UC1", is_bigendian=1, step=4, data=depth.tobytes())
    yield "/depth", image, 1, 0


def test_images_are_decoded_when_they_are_accessed(folder: Path) -> None:
    with open_bags(written("run.bag", list(picture()))) as bags:
        raw, depth = bags.table("/raw"), bags.table("/depth")

    assert raw["_image"][0].tolist() == np.arange(18).reshape(2, 3, 3).tolist()
    with pytest.raises(PictureError, match="24 bytes in total, got rows of 12, and 23 in total"):
        raw["_image"][1]
    assert [each.tolist() for each in depth["_image"]] == [[[1, 2], [3, 4]]]
    assert "_image" not in list(raw)
    with pytest.raises(KeyError):
        raw["_points"]


def test_an_nv21_image_of_odd_height_has_a_whole_second_plane(folder: Path) -> None:
    data = bytes(range(16))
    image = Image(height=5, width=2, encoding="nv21", step=2, data=data)
    short = Image(height=5, width=2, encoding="nv21", step=2, data=data[:14])
    with open_bags(written("run.bag", [("/raw", image, 1, 0), ("/raw", short, 2, 0)])) as bags:
        column = bags.table("/raw")["_image"]

    assert column[0].tolist() == np.arange(16).reshape(8, 2).tolist()
    with pytest.raises(PictureError, match=r"2 x 8 pixels of nv21 .* 16 bytes in total, .* and 14 in total"):
        column[1]


def test_compressed_images_keep_their_bytes(folder: Path) -> None:
    import cv2

    jpeg = cv2.imencode(".jpg", np.full((4, 5, 3), 90, np.uint8))[1].tobytes()
    message = CompressedImage(format="jpeg", data=jpeg)
    with open_bags(written("run.bag", [("/camera/compressed", message, 1, 0)])) as bags:
        table = bags.table("/camera/compressed")

    assert (table["data"][0], table["_image"][0].shape) == (jpeg, (4, 5, 3))


def test_clouds_are_structured_arrays(folder: Path) -> None:
    points = np.zeros(
        (1, 2), {"names": ["x", "rgb"], "formats": ["<f4", "<u4"], "offsets": [0, 8], "itemsize": 12}
    )
    points["x"], points["rgb"] = [[1.5, 2.5]], [[7, 8]]
    fields = [PointField("x", 0, 7, 1), PointField("rgb", 8, 6, 1)]
    cloud = PointCloud2(height=1, width=2, fields=fields, point_step=12, row_step=24, data=points.tobytes())
    wide = PointCloud2(height=1, width=2, fields=[PointField("x", 10, 7, 1)], point_step=12, row_step=24)
    short = PointCloud2(height=1, width=2, fields=fields, point_step=12, row_step=24, data=b"x")
    rows: list[Row] = [("/c", each, at, 0) for at, each in enumerate((cloud, wide, short), 1)]
    with open_bags(written("run.bag", rows)) as bags:
        column = bags.table("/c")["_points"]

    assert (column[0]["x"].tolist(), column[0]["rgb"].tolist()) == ([[1.5, 2.5]], [[7, 8]])
    with pytest.raises(PictureError, match="'x' must be unique and fit into a point of 12 bytes"):
        column[1]
    with pytest.raises(PictureError, match=r"2 x 1 points .* got rows of 24, and 1 in total"):
        column[2]
    assert len(column) == 3
