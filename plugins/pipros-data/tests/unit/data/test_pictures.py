"""Images and point clouds as columns that are decoded when they are accessed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image, PointCloud2, PointField

from pipros_data import open_bags
from pipros_libraries.pictures.errors import PictureError
from tests.support.bags import Row, bag_bytes


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
