"""Messages: conversion to JSON, CBOR and BSON, and back."""

import base64
import io
import json
import random
import struct
from contextlib import suppress
from typing import Any

import bson
import cbor2
import pytest
from PIL import Image

from pipros.msg import load_message_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.spec import NUMBERS
from pipros_bridges.rosbridge.encoding import Encoder, WireEncoding, fragment_frames, operation_frame
from pipros_bridges.rosbridge.filling import Filler, UnknownField, WrongValue
from pipros_bridges.rosbridge.plain_values import Format, NotRepresentable, PlainValues
from pipros_bridges.shared_topics import TopicMessage
from tests.support.constants import Constants
from tests.support.random_messages import fill_at_random, serialized, shipped_types

NOW_NS = 1_700_000_000_000_000_123
FILLER = Filler(lambda: NOW_NS)


def received(message: Any, topic: str = "/topic") -> TopicMessage:
    """A message as it arrives from a publisher."""
    header = {"type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text}
    return TopicMessage(topic, serialized(message), header, NOW_NS)


def data_of(message: Any, encoding: WireEncoding, *, encoder: Encoder | None = None) -> bytes:
    (frame,) = (encoder or Encoder()).encoded(received(message)).frames(encoding, "/topic")
    return b"".join(frame.parts)


def filled(type_name: str, values: Any) -> Any:
    message = load_message_class(type_name)()
    FILLER.fill(message, values)
    return message


def plain(value: Any) -> Any:
    """Values of CBOR, with its typed arrays as lists."""
    codes = {69: "H", 70: "I", 71: "Q", 72: "b", 77: "h", 78: "i", 79: "q", 85: "f", 86: "d"}
    if isinstance(value, cbor2.CBORTag):
        code = codes[value.tag]
        return [number for (number,) in struct.iter_unpack(f"<{code}", value.value)]
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list) else value


@pytest.mark.parametrize("type_name", shipped_types())
def test_random_messages_of_every_type_survive_each_format(type_name: str) -> None:
    rng = random.Random(type_name)  # noqa: S311
    for _ in range(3):
        message = fill_at_random(load_message_class(type_name)(), rng, finite=True)
        values = json.loads(data_of(message, WireEncoding.JSON))["msg"]
        assert serialized(filled(type_name, values)) == serialized(message)
        values = plain(cbor2.loads(data_of(message, WireEncoding.CBOR))["msg"])
        assert serialized(filled(type_name, values)) == serialized(message)
        with suppress(NotRepresentable):  # uint64
            data = data_of(message, WireEncoding.JSON, encoder=Encoder(is_bson=True))
            assert serialized(filled(type_name, bson.decode(data)["msg"])) == serialized(message)


def json_by_both(message: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    """Return a message's JSON by orjson, and by the standard library."""
    fast = data_of(message, WireEncoding.JSON)
    with monkeypatch.context() as without:
        without.setattr("pipros_bridges.rosbridge.encoding.ORJSON", None)
        return fast.decode(), data_of(message, WireEncoding.JSON).decode()


def equal_texts(text: str) -> Any:
    """Return JSON as values in which numbers keep whether they are integers, and -0.0 its sign."""
    return json.loads(text, parse_float=lambda digits: repr(float(digits)), parse_constant=pytest.fail)


@pytest.mark.parametrize("type_name", shipped_types())
def test_json_is_the_same_with_and_without_orjson(type_name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = random.Random(type_name)  # noqa: S311
    for _ in range(3):
        message = fill_at_random(load_message_class(type_name)(), rng)
        fast, slow = json_by_both(message, monkeypatch)
        assert equal_texts(fast) == equal_texts(slow)


@pytest.mark.parametrize("base", [*NUMBERS, "bool"])
@pytest.mark.parametrize("length", ["", "3", "300"])
@pytest.mark.parametrize("numpy", [True, False])
def test_arrays_of_numbers_are_the_same_with_and_without_orjson(
    base: str, length: str, numpy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not numpy:
        monkeypatch.setattr("pipros.msg.compile.plain._numpy", lambda: None)
    text = f"uint8 before\n{base}[{length}] values\nstring after"
    cls = message_classes_from_text("test_msgs/Array", text)["test_msgs/Array"]
    rng = random.Random(length)  # noqa: S311
    for count in [int(length)] if length else [0, 31, 32, 1000]:
        code, size = NUMBERS[base], struct.calcsize(f"<{NUMBERS[base]}")
        body = rng.randbytes(count * size) if code != "?" else bytes(rng.choices(range(4), k=count))
        message = cls._from_bytes(
            b"\1" + (b"" if length else struct.pack("<I", count)) + body + struct.pack("<I2s", 2, b"\xffz")
        )
        fast, slow = json_by_both(message, monkeypatch)
        assert equal_texts(fast) == equal_texts(slow)


def test_json_of_times_beyond_a_second_and_of_bad_text_is_the_same_with_orjson(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cls = load_message_class("std_msgs/Header")
    header = {"type": cls._type, "md5sum": cls._md5sum, "message_definition": cls._full_text}
    body = struct.pack("<IIII3s", 7, 5, 2_500_000_000, 3, b"a\xffb")
    message = TopicMessage("/topic", body, header, NOW_NS)
    (frame,) = Encoder().encoded(message).frames(WireEncoding.JSON, "/topic")
    monkeypatch.setattr("pipros_bridges.rosbridge.encoding.ORJSON", None)
    (other,) = Encoder().encoded(message).frames(WireEncoding.JSON, "/topic")
    values = json.loads(b"".join(frame.parts))
    assert values == json.loads(b"".join(other.parts))
    assert values["msg"] == {"seq": 7, "stamp": {"secs": 7, "nsecs": 500_000_000}, "frame_id": "a\ufffdb"}


def test_nan_and_infinity_are_null_in_json_and_png_and_kept_in_cbor_and_bson() -> None:
    message = load_message_class("geometry_msgs/Point32")(1.0, float("nan"), float("-inf"))
    assert json.loads(data_of(message, WireEncoding.JSON))["msg"] == {"x": 1.0, "y": None, "z": None}
    picture = base64.b64decode(json.loads(data_of(message, WireEncoding.PNG))["data"])
    text = Image.open(io.BytesIO(picture)).convert("RGB").tobytes()
    assert json.loads(text)["msg"] == {"x": 1.0, "y": None, "z": None}
    for data in (
        cbor2.loads(data_of(message, WireEncoding.CBOR)),
        bson.decode(data_of(message, WireEncoding.JSON, encoder=Encoder(is_bson=True))),
    ):
        assert str(data["msg"]) == "{'x': 1.0, 'y': nan, 'z': -inf}"


def test_the_picture_of_a_text_has_its_bytes_as_pixels() -> None:
    message = load_message_class("std_msgs/String")("ünïcode")
    picture = base64.b64decode(json.loads(data_of(message, WireEncoding.PNG))["data"])
    text = Image.open(io.BytesIO(picture)).tobytes().rstrip(b"\n")
    assert json.loads(text) == {"op": "publish", "topic": "/topic", "msg": {"data": "ünïcode"}}


def test_octets_are_base64_in_json_and_bytes_in_cbor() -> None:
    message = load_message_class("sensor_msgs/CompressedImage")(format="png", data=b"\0\xff")
    assert json.loads(data_of(message, WireEncoding.JSON))["msg"]["data"] == "AP8="
    assert cbor2.loads(data_of(message, WireEncoding.CBOR))["msg"]["data"] == b"\0\xff"


def test_cbor_has_typed_arrays_lists_of_strings_and_fixed_arrays() -> None:
    floats = cbor2.loads(
        data_of(load_message_class("std_msgs/Float32MultiArray")(data=[1.5]), WireEncoding.CBOR)
    )
    assert floats["msg"]["data"] == cbor2.CBORTag(85, struct.pack("<f", 1.5))
    names = load_message_class("sensor_msgs/JointState")(name=["a", "b"])
    assert cbor2.loads(data_of(names, WireEncoding.CBOR))["msg"]["name"] == ["a", "b"]
    imu = cbor2.loads(data_of(load_message_class("sensor_msgs/Imu")(), WireEncoding.CBOR))
    assert imu["msg"]["orientation_covariance"] == cbor2.CBORTag(86, bytes(72))


def test_raw_cbor_has_the_serialized_message_and_the_time_of_arrival() -> None:
    message = load_message_class("std_msgs/String")("x")
    assert cbor2.loads(data_of(message, WireEncoding.CBOR_RAW)) == {
        "op": "publish",
        "topic": "/topic",
        "msg": {"secs": 1_700_000_000, "nsecs": 123, "bytes": b"\1\0\0\0x"},
    }


def test_integers_beyond_two_to_the_53_are_exact() -> None:
    for value in (2**53 + 1, 2**63 - 1, -(2**63)):
        message = load_message_class("std_msgs/Int64")(value)
        assert data_of(message, WireEncoding.JSON).decode().endswith(f'"msg":{{"data":{value}}}}}')
        assert filled("std_msgs/Int64", {"data": value}).data == value


def test_bson_refuses_integers_of_64_bits_with_the_name_of_the_field() -> None:
    values = PlainValues(Format.BSON)
    for name, value in (("UInt64", 2**64 - 1), ("UInt64MultiArray", [0, 2**64 - 1])):
        message = load_message_class(f"std_msgs/{name}")(data=value)
        with pytest.raises(NotRepresentable, match="field data: BSON integers must be <="):
            values.of(message)


def test_a_message_is_encoded_once_for_all_clients_of_an_encoding() -> None:
    encoder = Encoder()
    message = received(load_message_class("std_msgs/String")("x"))
    first = encoder.encoded(message).frames(WireEncoding.JSON, "/topic")
    assert encoder.encoded(message).frames(WireEncoding.JSON, "/topic") is first


def test_a_long_text_is_sent_in_fragments() -> None:
    whole = operation_frame({"op": "status", "msg": "ä" * 50})
    text = b"".join(whole.parts).decode()
    fragments = [json.loads(b"".join(frame.parts)) for frame in fragment_frames(whole, 40)]
    assert "".join(each["data"] for each in fragments) == text
    assert [each["num"] for each in fragments] == list(range(len(fragments)))
    assert {each["total"] for each in fragments} == {len(fragments)}
    assert (fragment_frames(whole, 10_000), fragment_frames(whole, 0)) == ((whole,), (whole,))


@pytest.mark.parametrize(("type_name", "values", "error"), [
    ("std_msgs/Int32", {"data": 1.0}, "field data must be an integer (int32), got 1.0"),
    ("std_msgs/Int32", {"data": True}, "field data must be an integer (int32), got true"),
    ("std_msgs/Int32", {"data": "1"}, "field data must be an integer (int32), got '1'"),
    ("std_msgs/UInt8", {"data": 256}, "field data must be from 0 to 255 (uint8), got 256"),
    ("std_msgs/Int8", {"data": -129}, "field data must be from -128 to 127 (int8), got -129"),
    ("std_msgs/Int64", {"data": 10**90}, "field data must be from -9223372036854775808 to "),
    ("std_msgs/Bool", {"data": 1}, "field data must be true or false, got 1"),
    ("std_msgs/Float64", {"data": None}, "field data must be a number (float64), got null"),
    ("std_msgs/Float32", {"data": 1e300}, "field data is too large for a float32: 1e+300"),
    ("std_msgs/Float64", {"data": 10**400}, "field data is too large for a float64: a number of more"),
    ("std_msgs/String", {"data": 5}, "field data must be a string, got 5"),
    ("std_msgs/String", {"data": "\ud800"}, "field data must be a valid Unicode string"),
    ("std_msgs/String", {"date": ""}, "field date does not exist: std_msgs/String has data"),
    ("std_msgs/Time", {"data": 5}, 'field data must be an object {"secs": …, "nsecs": …} or "now"'),
    ("std_msgs/Duration", {"data": "now"}, "field data must be an object"),
    ("std_msgs/Time", {"data": {"secs": -1}}, "field data.secs must be from 0 to 4294967295 (uint32)"),
    ("std_msgs/Time", {"data": {"sec": 1}}, "field data.sec does not exist: a time has secs, nsecs"),
    ("geometry_msgs/Pose", {"position": {"x": "a"}}, "field position.x must be a number (float64)"),
    ("geometry_msgs/Pose", {"position": None}, "field position must be an object (geometry_msgs/Point)"),
    (
        "geometry_msgs/Polygon",
        {"points": [{}, {"y": []}]},
        "field points[1].y must be a number (float32)",
    ),
    ("geometry_msgs/Polygon", {"points": 3}, "field points must be an array (geometry_msgs/Point32[])"),
    ("sensor_msgs/Imu", {"orientation_covariance": [0.0]}, "orientation_covariance must have 9 elements"),
    ("sensor_msgs/CompressedImage", {"data": "A"}, "field data must be base64 text or an array"),
    ("sensor_msgs/CompressedImage", {"data": [256]}, "field data[0] must be from 0 to 255 (uint8)"),
    ("sensor_msgs/JointState", {"name": ["a", 1]}, "field name[1] must be a string, got 1"),
])  # fmt: skip
def test_wrong_values_are_refused_with_the_name_of_the_field(type_name: str, values: Any, error: str) -> None:
    with pytest.raises(WrongValue) as caught:
        filled(type_name, values)
    assert error in str(caught.value)


def test_an_unknown_field_has_its_own_error() -> None:
    with pytest.raises(UnknownField):
        filled("std_msgs/String", {"x": 1})


def test_missing_fields_keep_their_defaults_and_integers_are_floats() -> None:
    pose = filled("geometry_msgs/PoseStamped", {"pose": {"position": {"x": 1}}})
    assert (pose.pose.position.x, pose.pose.position.y) == (1.0, 0.0)


def test_only_a_given_header_without_stamp_is_stamped() -> None:
    empty = filled("geometry_msgs/PoseStamped", {"header": {"stamp": {}}})
    assert empty.header.stamp.to_nsec() == NOW_NS
    given = filled("geometry_msgs/PoseStamped", {"header": {"frame_id": "map"}})
    assert (given.header.stamp.to_nsec(), given.header.frame_id) == (NOW_NS, "map")
    assert filled("geometry_msgs/PoseStamped", {}).header.stamp.to_nsec() == 0
    stamped = filled("geometry_msgs/PoseStamped", {"header": {"stamp": {"secs": 1}}})
    assert stamped.header.stamp.to_nsec() == 1_000_000_000
    in_list = filled("tf2_msgs/TFMessage", {"transforms": [{"header": {}}, {}]})
    assert [each.header.stamp.to_nsec() for each in in_list.transforms] == [NOW_NS, 0]


def test_now_is_the_present_time() -> None:
    assert filled("std_msgs/Time", {"data": "now"}).data.to_nsec() == NOW_NS


def test_literals_of_nan_and_infinity_are_accepted() -> None:
    values = json.loads('{"x": NaN, "y": Infinity, "z": -Infinity}')
    assert str(filled("geometry_msgs/Point", values)).split() == ["x:", "nan", "y:", "inf", "z:", "-inf"]


def test_a_list_gives_the_first_fields_and_may_be_longer_or_shorter() -> None:
    assert filled("geometry_msgs/Point", [1.0, 2.0]).y == 2.0
    assert filled("geometry_msgs/Point", [1.0, 2.0, 3.0, 4.0]).z == 3.0
    assert filled("geometry_msgs/Point", "neither").x == 0.0


def test_octets_are_accepted_as_base64_and_as_numbers() -> None:
    for data in ("AQID", [1, 2, 3], b"\1\2\3"):
        assert filled("sensor_msgs/CompressedImage", {"data": data}).data == b"\1\2\3"


def test_small_text_cannot_make_a_message_of_any_size(constants: Constants) -> None:
    constants(MESSAGE_VALUES=1000)
    filler = Filler(lambda: 0)
    with pytest.raises(WrongValue, match="makes the message too large; the limit is 1000"):
        filler.fill(load_message_class("nav_msgs/Path")(), {"poses": [{}] * 200})
