from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import Vector3Stamped
from sensor_msgs.msg import CompressedImage, Image, JointState
from std_msgs.msg import Header

from pipros.bag import BagError
from pipros.bag.images import image_file
from pipros.cli.rosbag import main
from pipros.msg.time import Time
from tests.support.bags import bag_bytes


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    rows: list[Any] = []
    for n in range(3):
        point = Vector3Stamped(header=Header(stamp=Time(n, 5), frame_id="a,b"))
        point.vector.x = n / 2
        rows.append(("/deep/point", point, n, 7))
        rows.append(("/joints", JointState(position=[1.0] * n, velocity=[float(n), 2.0]), n, 8))
    rows.append(("/camera", image("rgb8"), 9, 10))
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes(rows))
    return path


def image(encoding: str, data: bytes = bytes(range(12)), **more: Any) -> Image:
    return Image(encoding=encoding, width=2, height=2, step=6, data=data, **more)


def pixels(png: bytes) -> bytes:
    """Return the rows of a PNG file without filters, each after a zero."""
    at = png.index(b"IDAT")
    (size,) = struct.unpack(">I", png[at - 4 : at])
    return zlib.decompress(png[at + 4 : at + 4 + size])


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


def test_topics_become_arrays(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--format", "npz", "run.bag", "out", "/deep/point", "/joints"]) == 0

    with numpy.load("out/deep__point.npz") as found:
        assert found["vector.x"].tolist() == [0.0, 0.5, 1.0]
        assert found["header.stamp"].tolist() == [5, 1000000005, 2000000005]
        assert found["time"].tolist() == [7, 1000000007, 2000000007]
    with numpy.load("out/joints.npz") as found:
        assert found["velocity"].tolist() == [[0.0, 2.0], [1.0, 2.0], [2.0, 2.0]]
        assert "position" not in found
    assert "/joints: position is omitted" in capsys.readouterr().err


def test_samples_are_in_the_order_of_png() -> None:
    assert pixels(image_file(image("bgr8"))[1]) == b"\0\2\1\0\5\4\3\0\x08\7\6\x0b\x0a\x09"
    depth = image("16UC1", bytes(range(12)))
    assert pixels(image_file(depth)[1]) == b"\0\1\0\3\2\0\7\6\x09\x08"
    deep = Image(encoding="bgr16", width=1, height=1, step=6, data=b"\1\2\3\4\5\6")
    assert pixels(image_file(deep)[1]) == b"\0\6\5\4\3\2\1"
    assert pixels(image_file(image("8UC3"))[1]) == pixels(image_file(image("bgr8"))[1])
    jpeg = CompressedImage(data=b"\xff\xd8x", format="jpeg")
    assert image_file(jpeg) == (".jpg", b"\xff\xd8x")


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (image("yuv423"), r"Unrecognized image encoding \[yuv423\]"),
        (Image(encoding="mono8"), "the image is empty: 0 x 0 pixels"),
        (Image(encoding="32FC1"), "the image is empty: 0 x 0 pixels"),
        (CompressedImage(format="jpeg"), "the image is empty"),
        (CompressedImage(format="jpeg", data=b"no image"), "begins like no known format: 6e 6f 20"),
        (CompressedImage(format="16UC1; compressedDepth png", data=bytes(12)), "more than 12 bytes, got 12"),
        (image("rgb8", b"x"), "need 2 rows of 6 bytes, got 1 bytes in rows of 6"),
        (image("rgba8"), "need 2 rows of 8 bytes"),
    ],
)
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
