"""Parts of bags that a browser saves."""

import re
import struct
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_page.bags.export import FORMATS, export
from pipros_page.bags.newest import newest_before
from pipros_tools.bag import BagError, BagReader, BagWriter
from tests.support.bags import bag_bytes

SECOND = 10**9


@pytest.fixture
def numbers(tmp_path: Path) -> Path:
    """A bag with a number at each second from 1000 to 1099, and one text at 1000."""
    path = tmp_path / "numbers.bag"
    with path.open("wb") as file:
        bag = BagWriter(file, chunk_bytes=200)
        added = {}
        for topic, name in (("/number", "std_msgs/Float64"), ("/text", "std_msgs/String")):
            kind = load_message_class(name)
            fields = {"type": name, "md5sum": kind._md5sum, "message_definition": kind._full_text}
            header = {"topic": topic.encode(), **{key: value.encode() for key, value in fields.items()}}
            added[topic] = bag.add_connection(topic, header)
        bag.write(added["/text"], 1000, 0, b"\x00\x00\x00\x00")
        for second in range(100):
            bag.write(added["/number"], 1000 + second, 0, struct.pack("<d", second))
        bag.finish()
    return path


@pytest.mark.parametrize("form", FORMATS[:2])
def test_a_selection_above_the_limit_is_refused(numbers: Path, form: str) -> None:
    with BagReader(numbers) as bag, pytest.raises(BagError, match=r"limit is 100 .page_export_bytes"):
        export(bag, ["/number"], (0, 2000 * SECOND), form, BytesIO(), 100)


def test_the_newest_message_before_a_moment_is_found_far_back(numbers: Path) -> None:
    with BagReader(numbers) as bag:
        found = newest_before(bag, bag.connections_of("/text"), 1099 * SECOND)
        assert found is not None
        assert found.time_ns == 1000 * SECOND
        exact = newest_before(bag, bag.connections_of("/number"), 1007 * SECOND + 5)
        assert exact is not None
        assert exact.time_ns == 1007 * SECOND
        assert newest_before(bag, bag.connections_of("/text"), 999 * SECOND) is None


@pytest.mark.parametrize("topic", ["/..", "/", "..\\..\\up", "/c:"])
def test_no_topic_of_a_bag_leaves_the_zip_file(tmp_path: Path, topic: str) -> None:
    kind = load_message_class("sensor_msgs/Image")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    header = {key: value.encode() for key, value in fields.items()}
    image = kind(height=1, width=1, step=1, encoding="mono8", data=b"\x07")
    with (tmp_path / "images.bag").open("wb") as file:
        bag = BagWriter(file)
        added = bag.add_connection(topic, {"topic": topic.encode(), **header})
        bag.write(added, 1000, 0, b"".join(image._to_buffers()))
        bag.finish()
    for form in ("csv", "images"):
        part = BytesIO()
        with BagReader(tmp_path / "images.bag") as whole:
            export(whole, [topic], (0, 2000 * SECOND), form, part, 1000)
        with zipfile.ZipFile(part) as archive:
            (name,) = archive.namelist()
        assert re.fullmatch(r"\w+(/\d{6}_1000\.0{9})?\.\w+", name), name


def test_an_exported_bag_begins_with_the_latched_messages(tmp_path: Path) -> None:
    path = tmp_path / "latched.bag"
    kind = load_message_class("std_msgs/String")
    fields = {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
    header = {key: value.encode() for key, value in fields.items()}
    with path.open("wb") as file:
        bag = BagWriter(file)
        for topic, latching in (("/map", b"1"), ("/tf_static", b"1"), ("/talk", b"0")):
            added = bag.add_connection(topic, {"topic": topic.encode(), "latching": latching, **header})
            for second, text in enumerate("abc"):
                bag.write(added, 1000 + second, 0, b"\x01\x00\x00\x00" + text.encode())
        bag.finish()
    part = BytesIO()
    with BagReader(path) as whole:
        topics = ["/map", "/talk", "/tf_static"]
        export(whole, topics, (1002 * SECOND, 1003 * SECOND), "bag", part, 1000)
    (tmp_path / "part.bag").write_bytes(part.getvalue())
    with BagReader(tmp_path / "part.bag") as cut:
        found = sorted((message.connection.topic, message.data[-1:]) for message in cut.stored_messages())
        assert cut.range_ns[0] == 1002 * SECOND
    assert found == [
        ("/map", b"b"), ("/map", b"c"), ("/talk", b"c"), ("/tf_static", b"a"), ("/tf_static", b"b"),
        ("/tf_static", b"c"),
    ]  # fmt: skip


@pytest.mark.parametrize("bad", [0, 1, 2])
def test_an_image_that_cannot_be_written_does_not_end_the_export(bad: int, tmp_path: Path) -> None:
    kind: Any = load_message_class("sensor_msgs/Image")
    good = kind(height=1, width=1, step=1, encoding="mono8", data=b"x")
    rows = [("/camera", kind() if number == bad else good, number, 0) for number in range(3)]
    (tmp_path / "images.bag").write_bytes(bag_bytes(rows))

    with BagReader(tmp_path / "images.bag") as bag, (tmp_path / "out.zip").open("w+b") as file:
        export(bag, ["/camera"], (0, 9 * 10**9), "images", file, 1 << 20)
    with zipfile.ZipFile(tmp_path / "out.zip") as archive:
        names = sorted(archive.namelist())
        reason = archive.read("left_out.txt").decode()

    seconds = [number for number in range(3) if number != bad]
    assert names == [f"camera/{n:06d}_{n}.000000000.png" for n in seconds] + ["left_out.txt"]
    assert f"messages on /camera are left out: the message received at {bad}.000000000: the image" in reason
