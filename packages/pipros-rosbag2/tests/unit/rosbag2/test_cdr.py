"""Messages as plain values, compared with the library rosbags."""

import math
import sqlite3
import struct
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.msg.language.digest import SEPARATOR
from pipros_rosbag2.bags.reader import Ros2BagReader
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog
from pipros_rosbag2.interfaces.cdr import CdrError, decode, encode
from pipros_rosbag2.interfaces.installed import installed_definitions
from pipros_rosbag2.interfaces.parse import messages_from_text, parse_ros2_message
from pipros_tools.cli.rosbag import main

CATALOG = Catalog(Distribution.JAZZY, installed_definitions())


ALL = parse_ros2_message(
    "bool b true\nbyte y\nchar c\nint8 i -3\nuint64 u\nfloat32 f\nfloat64 d 0.5\nstring<=3 s\nwstring w\n"
    "int16[3] a\nint32[<=2] n\nstring[] t\nbuiltin_interfaces/Time stamp\nstd_msgs/Header[] h\n",
    "own/msg/All",
)


VALUES: dict[str, Any] = {
    "b": False, "y": 200, "c": 7, "i": -128, "u": 2**64 - 1, "f": 0.25, "d": math.inf, "s": "äb", "w": "wé",
    "a": [1, -2, 3], "n": [4], "t": ["", "x"], "stamp": {"sec": -1, "nanosec": 5},
    "h": [{"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"}],
}  # fmt: skip


def test_all_kinds_of_fields_survive() -> None:
    assert decode(encode(VALUES, ALL, CATALOG.message), ALL, CATALOG.message) == VALUES


def test_missing_fields_have_their_defaults() -> None:
    values = decode(encode({}, ALL, CATALOG.message), ALL, CATALOG.message)

    assert (values["b"], values["i"], values["d"], values["a"], values["n"]) == (True, -3, 0.5, [0, 0, 0], [])
    assert values["stamp"] == {"sec": 0, "nanosec": 0}


def test_the_bytes_are_those_of_rosbags() -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    message = CATALOG.message("sensor_msgs/msg/JointState")
    values = {
        "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "base"}, "name": ["a", "bcd"],
        "position": [1.5, 2.5], "velocity": [], "effort": [-1.0],
    }  # fmt: skip
    payload = encode(values, message, CATALOG.message)

    theirs = store.deserialize_cdr(payload, message.type)
    assert bytes(store.serialize_cdr(theirs, message.type)) == payload


def test_a_wide_string_has_the_bytes_of_rmw_fastrtps() -> None:
    message = parse_ros2_message("wstring w", "own/msg/Wide")
    payload = bytes.fromhex("00010000 03000000 77000000 34d80000 1edd0000")  # by rclpy of Jazzy and of Kilted

    assert decode(payload, message, CATALOG.message) == {"w": "w𝄞"}
    assert encode({"w": "w𝄞"}, message, CATALOG.message) == payload


def test_an_empty_message_has_no_fields() -> None:
    empty = CATALOG.message("std_msgs/msg/Empty")

    assert decode(encode({}, empty, CATALOG.message), empty, CATALOG.message) == {}
    assert len(encode({}, empty, CATALOG.message)) == 5


@pytest.mark.parametrize(("values", "error"), [
    ({"z": 1}, r"own/msg/All has no field \[z\]; its fields: b, y"),
    ({"b": 1}, "b must be of the type bool, got 1"), ({"i": True}, "i must be of the type int8, got True"),
    ({"i": 200}, "i must be from -128 to 127, got 200"),
    ({"s": "abcd"}, "s must have at most 3 characters, got 4"), ({"s": 1}, "s must be a text, got 1"),
    ({"a": [1]}, "a must have 3 elements, got 1"),
    ({"n": [1, 2, 3]}, "n must have at most 2 elements, got 3"), ({"t": "x"}, "t must be a list, got 'x'"),
    ({"stamp": {"secs": 1}}, r"has no field \[secs\]"),
    ({"h": [{"stamp": 1}]}, "h.stamp must be a mapping of fields, got 1"),
])  # fmt: skip
def test_values_of_the_wrong_type_are_named(values: dict[str, Any], error: str) -> None:
    with pytest.raises(CdrError, match=error):
        encode(values, ALL, CATALOG.message)


def test_each_truncated_message_is_refused() -> None:
    payload = encode(VALUES, ALL, CATALOG.message)

    for size in range(len(payload)):
        with pytest.raises(PiprosError):
            decode(payload[:size], ALL, CATALOG.message)


def test_a_huge_sequence_of_a_short_message_is_refused() -> None:
    message = parse_ros2_message("std_msgs/Empty[] e", "own/msg/Many")

    with pytest.raises(CdrError, match="does not fit"):
        decode(b"\0\1\0\0" + b"\xff" * 4, message, CATALOG.message)


# Messages of services and actions in ROS 2 bags, recorded with the definition of the whole interface.


SERVICE = f"Part[] parts # of the request\n---\nint64 sum\n{SEPARATOR}\nMSG: own/Part\nint8 x"


ACTION = "int32 order\n---\nint32[] result\n---\nint32[] partial"


GID = bytes(range(16))


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def write(kind: str, text: str, body: bytes) -> None:
    """Write `run.db3`, with a message of the type and the definition of its type."""
    database = sqlite3.connect("run.db3")
    columns = {
        "topics": "id, name, type, serialization_format, offered_qos_profiles",
        "messages": "id, topic_id, timestamp, data",
        "message_definitions": "id, topic_type, encoding, encoded_message_definition",
    }
    for table, names in columns.items():
        database.execute(f"CREATE TABLE {table}({names})")
    database.execute("INSERT INTO topics VALUES (1, '/event', ?, 'cdr', '')", (kind,))
    if text:
        database.execute("INSERT INTO message_definitions VALUES (1, ?, 'ros2msg', ?)", (kind, text))
    database.execute("INSERT INTO messages VALUES (1, 1, 1000000000, ?)", (b"\0\1\0\0" + body,))
    database.commit()
    database.close()


def read() -> Any:
    with Ros2BagReader(Path("run.db3")) as bag:
        assert bag.skipped == {}
        ((_, message, _, _),) = bag.messages()
    return message


def info(event_type: int) -> bytes:
    return struct.pack("<B3xiI16s4xq", event_type, 5, 6, GID, 7)


@pytest.mark.parametrize("title", ["", f"{SEPARATOR}\nSRV: own/srv/Add\n"])
def test_an_event_has_the_request_or_the_response(title: str) -> None:
    write("own/srv/Add_Event", title + SERVICE, info(1) + struct.pack("<IIbb2xI", 1, 2, 3, 4, 0))

    event = read()

    assert (event._type, event.info.event_type, event.info.sequence_number) == ("own/Add_Event", 1, 7)
    assert (event.info.stamp.to_nsec(), bytes(event.info.client_gid)) == (5 * 10**9 + 6, GID)
    assert [[part.x for part in request.parts] for request in event.request] == [[3, 4]]
    assert event.response == []


def test_an_event_of_a_known_service_needs_no_definition() -> None:
    write("std_srvs/srv/SetBool_Event", "", info(2) + struct.pack("<IIBxxxI3s", 0, 1, 1, 3, b"ok\0"))

    event = read()

    assert event.request == []
    assert [(each.success, each.message) for each in event.response] == [(True, "ok")]


@pytest.mark.parametrize(("part", "body", "field"), [
    ("FeedbackMessage", GID + struct.pack("<Iii", 2, 1, 1), lambda found: found.feedback.partial),
    ("SendGoal_Request", GID + struct.pack("<i", 8), lambda found: [found.goal.order]),
    ("GetResult_Response", struct.pack("<b3xIi", 4, 1, 9), lambda found: found.result.result),
])  # fmt: skip
def test_messages_of_an_action_are_read(part: str, body: bytes, field: Any) -> None:
    write(f"own/action/Count_{part}", ACTION, body)

    assert (
        list(field(read()))
        == {"FeedbackMessage": [1, 1], "SendGoal_Request": [8], "GetResult_Response": [9]}[part]
    )


def test_the_tables_of_events_have_their_fields(capsys: pytest.CaptureFixture[str]) -> None:
    write("own/srv/Add_Event", SERVICE, info(3) + struct.pack("<III4xq", 0, 1, 0, 12)[4:])

    assert main(["info", "run.db3"]) == 0
    assert "/event   1 msg     : own/Add_Event" in capsys.readouterr().out


def test_definitions_with_parts_belong_only_to_services_and_actions() -> None:
    assert list(messages_from_text("own/srv/Add_Request", SERVICE)) == [
        "own/srv/Add_Request", "own/srv/Add_Response", "own/srv/Add_Event", "own/msg/Part",
    ]  # fmt: skip
    for name in ("own/msg/Add", "own/srv/Add"):
        with pytest.raises(Exception, match=r"\[---\] is not a type"):
            messages_from_text(name, "int8 a\n---\nint8 b")
