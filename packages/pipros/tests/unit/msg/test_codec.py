"""Messages: conversion to bytes and back. test_golden.py compares the bytes with genpy's."""

import array
import copy
import io
import logging
import pickle
import struct
import tracemalloc
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import Point, PoseStamped, Twist
from nav_msgs.msg import Path
from sensor_msgs.msg import Image, Imu, JointState, LaserScan, PointCloud2, PointField
from std_msgs.msg import Empty, Float64MultiArray, Header, String, Time, UInt8MultiArray

import genpy
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError, SerializationError


def written(message: Message) -> bytes:
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def made(text: str) -> Any:
    """A class made from a definition."""
    return message_classes_from_text("made/T", text)["made/T"]


def made_of_two(text: str) -> Any:
    """A message with two messages of a definition, and a byte."""
    classes: Any = message_classes_from_text("made/T", f"E[] es\nint8 x\n{'=' * 80}\nMSG: made/E\n{text}")
    return classes["made/T"](es=[classes["made/E"]() for _ in range(2)])


class TestConstruction:
    def test_none_means_the_default(self) -> None:
        assert PoseStamped(header=None, pose=None) == PoseStamped()

    def test_defaults_are_not_shared_between_messages(self) -> None:
        Path().poses.append(PoseStamped())
        assert Path().poses == []
        assert Header().stamp is not Header().stamp

    def test_python_keywords_as_field_names_get_an_underscore(self) -> None:
        cls = made("int32 from\nint32 self\nstring None=x")
        assert (cls.__slots__, cls.None_) == (["from_", "self_"], "x")
        assert written(cls(from_=1, self_=2)) == struct.pack("<2i", 1, 2)

    @pytest.mark.parametrize(
        "name", ["Message", "len", "bytes", "list", "str", "ValueError", "struct", "float"]
    )
    def test_a_type_may_be_named_like_a_name_in_the_generated_code(self, name: str) -> None:
        text = "string a\nuint8[] b\nbool[] c\nfloat64[3] d\nfloat32 e\ntime[] f"
        cls: Any = message_classes_from_text(f"made/{name}", text)[f"made/{name}"]
        assert cls._from_bytes(written(cls(a="x", b=[1], c=[True], f=[genpy.Time(1)]))).b == b"\1"
        with pytest.raises(AttributeError, match="z is not an attribute"):
            cls(z=1)
        with pytest.raises(SerializationError):
            written(cls(e="x"))


class TestReading:
    def test_a_message_survives_a_round_trip_unchanged(self) -> None:
        message = JointState(Header(7, genpy.Time(1, 2), "ü"), ["a", "日本"], [0.5], [], [-1.0])
        assert JointState().deserialize(written(message)) == message
        assert JointState._from_bytes(memoryview(written(message))) == message

    def test_views_are_read_without_a_copy(self) -> None:
        message = Image(header=Header(frame_id="camera"), encoding="rgb8", data=b"abc")
        view = memoryview(b"head" + written(message) + b"tail")[4:]
        assert Image._from_bytes(view) == message
        assert type(Image._from_bytes(view).data) is bytes

    def test_arrays_of_numbers_are_tuples_those_of_octets_bytes_those_of_bools_lists(self) -> None:
        cls = made("int32[] a\nuint8[] b\nchar[] c\nbool[] d\nbool[2] e\nfloat32[2] f")
        read = cls().deserialize(written(cls([1], [2], b"c", [True], [1, 0], [0.5, 1])))
        assert [read.a, read.b, read.c, read.d, read.e, read.f] == [
            *((1,), b"\2", b"c", [True], [True, False], (0.5, 1.0))
        ]

    def test_nanoseconds_beyond_a_second_are_carried_over(self) -> None:
        assert Time().deserialize(struct.pack("<2I", 1, 2_500_000_000)).data == genpy.Time(3, 500_000_000)

    def test_bytes_after_the_message_are_ignored(self) -> None:
        assert String().deserialize(written(String("x")) + b"more") == String("x")

    @pytest.mark.parametrize("message", [
        String("hello"), Imu(), JointState(name=["a", "b"], position=[1.0], effort=[2.0]),
        Image(data=b"12345"), PointCloud2(fields=[PointField("x", 0, 7, 1)], data=b"123"),
        Path(poses=[PoseStamped(), PoseStamped()]), Float64MultiArray(data=[1.0, 2.0]),
        made("time[] a")([genpy.Time(1, 2)]), made_of_two("string s\nuint8[4] o"),
        made_of_two("float32[2] f\nduration d"),
    ], ids=lambda message: message._type)  # fmt: skip
    def test_every_missing_byte_is_noticed(self, message: Message) -> None:
        data = written(message)
        for length in range(len(data)):
            with pytest.raises(DeserializationError):
                type(message)().deserialize(data[:length])

    @pytest.mark.parametrize(
        "text", ["string a", "uint8[] a", "float64[] a", "string[] a", "time[] a", "bool[] a"]
    )
    def test_a_claimed_length_takes_no_memory(self, text: str) -> None:
        cls = made(text)
        tracemalloc.start()
        with pytest.raises(DeserializationError):
            cls().deserialize(b"\xff\xff\xff\xff" + bytes(20))
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 100_000

    def test_an_array_of_empty_messages_cannot_claim_billions(self) -> None:
        classes = message_classes_from_text("made/T", f"E[] es\n{'=' * 80}\nMSG: made/E\n\n")
        with pytest.raises(DeserializationError, match="has 4294901759 more values"):
            classes["made/T"]().deserialize(b"\xff\xff\xff\xff")
        assert len(classes["made/T"]().deserialize(b"\3\0\0\0").es) == 3

    def test_invalid_utf8_is_replaced_and_logged_once(self, caplog: pytest.LogCaptureFixture) -> None:
        cls = made("string a\nstring b")
        data = b"\2\0\0\0\xffx" + b"\1\0\0\0y"
        with caplog.at_level(logging.ERROR, "rosout"):
            for _ in range(3):
                read = cls().deserialize(data)
        assert (read.a, read.b) == ("\ufffdx", "y")
        (record,) = caplog.records
        assert "Characters replaced when decoding message made/T (will print only once)" in record.message


class TestWriting:
    @pytest.mark.parametrize("data", [
        *(b"\1\2\xff", [1, 2, 255], (1, 2, 255), bytearray(b"\1\2\xff"), memoryview(b"\1\2\xff")),
        *(array.array("B", [1, 2, 255]), numpy.array([1, 2, 255], dtype=numpy.uint8)),
    ], ids=lambda data: type(data).__name__)  # fmt: skip
    def test_octets_may_be_given_in_many_ways(self, data: Any) -> None:
        assert UInt8MultiArray().deserialize(written(UInt8MultiArray(data=data))).data == b"\1\2\xff"

    @pytest.mark.parametrize("data", [
        *([1.0, -2.5], (1.0, -2.5), array.array("d", [1, -2.5]), memoryview(array.array("d", [1, -2.5]))),
        *(numpy.array([1, -2.5]), numpy.array([1, -2.5], dtype=numpy.float32),
            numpy.array([1, 9, -2.5])[::2]),
        *(numpy.array([1, -2.5], dtype=">f8"), array.array("f", [1, -2.5])),
    ], ids=lambda data: f"{type(data).__name__}")  # fmt: skip
    def test_numbers_may_be_given_in_many_ways(self, data: Any) -> None:
        assert written(Float64MultiArray(data=data)) == written(Float64MultiArray(data=[1.0, -2.5]))

    def test_an_image_may_be_an_array_of_rows(self) -> None:
        pixels = numpy.arange(24, dtype=numpy.uint8).reshape(2, 4, 3)
        assert Image().deserialize(written(Image(data=pixels))).data == bytes(range(24))

    def test_floats_are_not_accepted_as_integers(self) -> None:
        with pytest.raises(SerializationError):
            written(made("int32[] a")(numpy.array([1.5])))
        with pytest.raises(SerializationError):
            written(UInt8MultiArray(data=numpy.array([1.5])))

    def test_large_arrays_are_buffers_without_a_copy(self) -> None:
        data = bytes(1000)
        assert any(buffer is data for buffer in Image(data=data)._to_buffers())

        points = numpy.zeros(1000)
        buffers = Float64MultiArray(data=points)._to_buffers()
        points[0] = 1.0
        assert b"".join(buffers) == written(Float64MultiArray(data=points))

    def test_the_buffers_together_are_the_message(self) -> None:
        message = PointCloud2(fields=[PointField("x", 0, 7, 1)], data=bytes(100), is_dense=True)
        assert b"".join(message._to_buffers()) == written(message)
        assert b"".join(Empty()._to_buffers()) == b""

    @pytest.mark.parametrize(("message", "words"), [
        (String(3), "field data must be of type bytes or an ascii string"),
        (Header(seq=-1), "field seq must be unsigned integer type"),
        (Path(poses=[Point()]),
            r"field poses\[\] must be of type geometry_msgs/PoseStamped instead of geometry_msgs/Point"),
        (Imu(orientation_covariance=[0.0] * 8),
            "Expecting 9 items but found 8 when writing 'self.orientation_covariance'"),
        (PoseStamped(header=String()),
            r"field header must be of type std_msgs/Header instead of std_msgs/String"),
        (LaserScan(ranges=["near"]), r"field ranges\[\] must be float type"),
    ], ids=lambda value: value if isinstance(value, str) else value._type)  # fmt: skip
    def test_a_wrong_value_is_named_and_nothing_is_written(self, message: Message, words: str) -> None:
        buff = io.BytesIO()
        with pytest.raises(SerializationError, match=words):
            message.serialize(buff)
        assert buff.getvalue() == b""


class TestNumpy:
    def test_arrays_of_numbers_become_numpy_arrays(self) -> None:
        scan = LaserScan(header=Header(frame_id="laser"), ranges=[1.0, 2.5], intensities=[3.0])
        read = LaserScan().deserialize_numpy(written(scan), numpy)
        assert (read.ranges.dtype, read.ranges.tolist()) == (numpy.float32, [1.0, 2.5])
        assert read.header == scan.header

    def test_octets_and_booleans_have_the_same_types(self) -> None:
        cls = made("float64[3] a\nuint8[] b\nchar[2] c\nbool[] d\nbool[2] e\nstring f")
        message = cls([1, 2, 3], b"xy", b"zz", [True], [True, False], "end")
        read = cls().deserialize_numpy(written(message), numpy)
        assert read.a.tolist() == [1, 2, 3]
        assert (read.b, read.c, read.d, read.e, read.f) == (b"xy", b"zz", [True], [True, False], "end")

    def test_they_share_the_memory_of_the_data(self) -> None:
        data = bytearray(written(Float64MultiArray(data=[1.0])))
        read = Float64MultiArray().deserialize_numpy(memoryview(data), numpy)
        data[-8:] = struct.pack("<d", 2.0)
        assert read.data[0] == 2.0

    def test_numpy_arrays_are_written_like_lists(self) -> None:
        buff = io.BytesIO()
        LaserScan(ranges=numpy.array([1, 2], dtype=numpy.float32)).serialize_numpy(buff, numpy)
        assert buff.getvalue() == written(LaserScan(ranges=[1, 2]))

    def test_too_few_bytes_raise(self) -> None:
        with pytest.raises(DeserializationError):
            Float64MultiArray().deserialize_numpy(written(Float64MultiArray(data=[1.0]))[:-1], numpy)


# The methods that every message class has.


def test_values_are_given_in_order_or_by_name() -> None:
    assert (Point(1.0, 2.0, 3.0), Point(x=1.0).y, Point().z) == (Point(z=3.0, y=2.0, x=1.0), 0.0, 0.0)


@pytest.mark.parametrize(("make", "kind", "words"), [
    (lambda: Point(1.0, y=2.0), TypeError, "may only use args OR keywords, not both"),
    (lambda: Point(1.0, 2.0), TypeError, "Invalid number of arguments, args should be"),
    (lambda: Point(w=1.0), AttributeError, "w is not an attribute of Point"),
    (lambda: setattr(Point(), "w", 1.0), AttributeError, "w"),
], ids=["both", "too few", "unknown", "set later"])  # fmt: skip
def test_values_that_do_not_fit_are_refused(make: Any, kind: type[Exception], words: str) -> None:
    with pytest.raises(kind, match=words):
        make()


def test_messages_are_equal_by_class_and_fields() -> None:
    assert Point(1.0, 2.0, 3.0) != Point(1.0, 2.0, 4.0)
    assert Point() != Twist()
    assert String("x") != "x"
    assert JointState(position=[1.0, 2.0]) == JointState(position=(1.0, 2.0))
    unfinished = Point()
    del unfinished.x
    assert unfinished != Point()


def test_messages_cannot_be_keys_because_they_change() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(Point())


def test_copies_and_pickles_are_independent_messages() -> None:
    message = PoseStamped()
    message.pose.position.x = 1.5
    for made in (copy.deepcopy(message), pickle.loads(pickle.dumps(message))):  # noqa: S301
        assert made == message
        assert made.pose is not message.pose
    shallow = copy.copy(message)
    assert (shallow, shallow.pose is message.pose) == (message, True)


def test_a_message_without_fields_takes_no_bytes() -> None:
    assert b"".join(Empty()._to_buffers()) == b""
    assert Empty._from_bytes(b"") == Empty()


def test_a_handwritten_class_has_the_methods_of_messages() -> None:
    class Nothing(Message):
        __slots__: list[str] = []  # as in genpy's classes
        _slot_types: list[str] = []  # noqa: RUF012

    message = Nothing()
    assert message.deserialize(b"anything") is message
    assert message.deserialize_numpy(b"anything", None) is message
    message.serialize_numpy(None, None)  # type: ignore[arg-type]
    assert Nothing._from_bytes(b"").__getstate__() == []
    with pytest.raises(SerializationError, match="a reason of its own"):
        message._check_types(ValueError("a reason of its own"))
