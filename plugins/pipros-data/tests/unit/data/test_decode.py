"""Every cell equals what rosbags reads from the same bytes; malformed messages are named."""

import random
import tracemalloc
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from pipros.msg import load_message_class
from pipros.msg.bulk.columns import joined_columns
from pipros.msg.bulk.cursors import joined_parts
from pipros.msg.bulk.decode import MalformedMessage, decode
from pipros.msg.bulk.plans import plan_of
from pipros.msg.language.spec import DefinitionError
from tests.support.random_messages import fill_at_random, serialized, shipped_types
from tests.unit.data.cells import cell, nested, plain, read_by_rosbags, same, seeded

NOT_IN_ROSBAGS = "kobuki_msgs/ButtonEvent"  # its constants have small letters
TYPES = [each for each in shipped_types() if each != NOT_IN_ROSBAGS]
PACKAGES = sorted({name.partition("/")[0] for name in TYPES})


def columns_of(type_name: str, payloads: list[bytes], **options: Any) -> Any:
    plan = plan_of(type_name, load_message_class(type_name)._full_text)  # type: ignore[attr-defined]
    return decode(plan, b"".join(payloads), np.cumsum([len(each) for each in payloads]), **options)


def differences(type_name: str, payloads: list[bytes]) -> list[str]:
    columns = columns_of(type_name, payloads)
    found = []
    for row, payload in enumerate(payloads):
        got = nested({name: cell(column, row) for name, column in columns.items()})
        found += same(plain(read_by_rosbags(type_name, payload)), got, type_name)
    return found


def payloads_of(type_name: str, count: int, rng: random.Random) -> list[bytes]:
    cls: Any = load_message_class(type_name)
    return [serialized(fill_at_random(cls(), rng)) for _ in range(count)]


@pytest.mark.parametrize("package", PACKAGES)
def test_cells_of_all_shipped_types_equal_those_of_rosbags(package: str) -> None:
    rng = seeded(package)
    found = []
    for type_name in (each for each in TYPES if each.partition("/")[0] == package):
        payloads = payloads_of(type_name, 3, rng)
        found += differences(type_name, payloads)
        found += differences(type_name, [payloads[0]] * 2)  # of equal size
    assert found == []


@pytest.mark.parametrize("type_name", [
    "sensor_msgs/JointState", "tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "sensor_msgs/Imu"
])  # fmt: skip
def test_cells_equal_those_of_rosbags_if_many_messages_are_read_together(type_name: str) -> None:
    assert differences(type_name, payloads_of(type_name, 80, seeded(1))) == []


def test_cells_equal_those_of_rosbags_if_arrays_are_long() -> None:
    rng = seeded(8)
    payloads: dict[str, list[bytes]] = {"tf2_msgs/TFMessage": [], "diagnostic_msgs/DiagnosticArray": []}
    for _ in range(60):
        stamped = [fill_at_random(TransformStamped(), rng) for _ in range(rng.randint(0, 12))]
        payloads["tf2_msgs/TFMessage"].append(serialized(TFMessage(stamped)))
        statuses = [fill_at_random(DiagnosticStatus(), rng) for _ in range(rng.randint(0, 9))]
        for status in statuses:
            status.values = [fill_at_random(KeyValue(), rng) for _ in range(rng.randint(0, 9))]
        payloads["diagnostic_msgs/DiagnosticArray"].append(serialized(DiagnosticArray(status=statuses)))
    for type_name, some in payloads.items():
        assert differences(type_name, some) == []
        assert differences(type_name, some[:5]) == []  # elements of few messages are skipped one by one


def test_columns_of_fixed_size_types_are_views_of_the_messages() -> None:
    data = np.frombuffer(b"".join(payloads_of("geometry_msgs/Twist", 50, seeded(2))), np.uint8)
    plan = plan_of("geometry_msgs/Twist", load_message_class("geometry_msgs/Twist")._full_text)  # type: ignore[attr-defined]

    columns = decode(plan, data, np.arange(48, 48 * 51, 48))

    assert [name for name, each in columns.items() if not np.shares_memory(each, data)] == []  # type: ignore[arg-type]
    assert {each.strides for each in columns.values() if isinstance(each, np.ndarray)} == {(48,)}


def test_messages_of_equal_layout_are_views_although_they_have_strings() -> None:
    payloads = payloads_of("sensor_msgs/Imu", 1, seeded(3)) * 50

    column = columns_of("sensor_msgs/Imu", payloads)["orientation_covariance"]

    assert (column.strides, column.base is not None) == ((len(payloads[0]), 8), True)


def test_arrays_of_equal_length_are_one_array_when_they_are_used() -> None:
    scans = [serialized(LaserScan(ranges=[n, 0.5, n])) for n in range(40)]
    ranges = columns_of("sensor_msgs/LaserScan", scans)["ranges"]

    assert [each.tolist() for each in ranges[5:7]] == [[5, 0.5, 5], [6, 0.5, 6]]
    assert (ranges.values.shape, ranges.values[18:21].tolist()) == ((120,), [6, 0.5, 6])


@pytest.mark.parametrize(
    "type_name", ["sensor_msgs/JointState", "tf2_msgs/TFMessage", "sensor_msgs/PointCloud2", "std_msgs/Time"]
)
@pytest.mark.parametrize("count", [3, 40])
def test_a_truncated_message_is_named(type_name: str, count: int) -> None:
    payloads = payloads_of(type_name, count, seeded(4))
    row = max(range(count), key=lambda number: len(payloads[number]))
    whole = payloads[row]
    for size in range(len(whole)):
        payloads[row] = whole[:size]
        with pytest.raises(
            MalformedMessage, match=f"its {size} bytes do not match the definition of"
        ) as error:
            columns_of(type_name, payloads)
        assert error.value.row == row


def test_an_empty_message_beside_a_truncated_one_is_named() -> None:
    with pytest.raises(MalformedMessage, match="its 0 bytes do not match") as error:
        columns_of("std_msgs/String", [b"\1\0\0\0a", b"", b"\0\0\0\0"])
    assert error.value.row == 1


def test_bytes_after_a_message_are_ignored_as_in_genpy() -> None:
    assert columns_of("std_msgs/Int8", [b"\1", b"\2more", b"\3"])["data"].tolist() == [1, 2, 3]


@pytest.mark.parametrize("type_name", [
    "sensor_msgs/JointState", "tf2_msgs/TFMessage", "std_msgs/String", "sensor_msgs/PointCloud2"
])  # fmt: skip
def test_claimed_lengths_allocate_no_memory(type_name: str) -> None:
    rng = seeded(5)
    payload = payloads_of(type_name, 1, rng)[0]
    tracemalloc.start()
    try:
        for at in range(len(payload) - 3):
            changed = payload[:at] + b"\xff\xff\xff\x7f" + payload[at + 4 :]
            try:
                columns_of(type_name, [payload, changed])
            except MalformedMessage as error:
                assert error.row == 1  # noqa: PT017 # some changes are in values
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4 << 20


def test_many_strings_in_one_message_are_found() -> None:
    texts = [f"{n}" for n in range(5000)]
    joined = b"".join(len(each).to_bytes(4, "little") + each.encode() for each in texts)
    plan = plan_of("a/B", "string[] some\nstring last")
    payload = (5000).to_bytes(4, "little") + joined + b"\1\0\0\0z"

    columns = decode(plan, payload, np.array([len(payload)]))

    assert (list(columns["some"][0]), columns["last"][0]) == (texts, "z")
    for cut in range(1, 12):
        with pytest.raises(MalformedMessage, match=r"bytes must follow at byte"):
            decode(plan, payload[:-cut], np.array([len(payload) - cut]))


def test_random_bytes_are_read_or_refused() -> None:
    rng = seeded(6)
    for type_name in ("tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "sensor_msgs/JointState"):
        for _ in range(100):
            payloads = payloads_of(type_name, 3, rng)
            damaged = bytearray(payloads[1])
            for _ in range(rng.randint(1, 4)):
                damaged[rng.randrange(len(damaged))] = rng.choice((0, 1, 2, 255, rng.randrange(256)))
            try:
                columns = columns_of(type_name, [payloads[0], bytes(damaged), payloads[2]])
            except MalformedMessage as error:
                assert error.row == 1  # noqa: PT017 # undamaged messages are never refused
            else:
                assert {len(column) for column in columns.values()} == {3}


def test_arrays_of_messages_without_bytes_become_their_lengths() -> None:
    text = f"std_msgs/Empty[] some\nint8 x\n{'=' * 80}\nMSG: std_msgs/Empty\n"
    payload = b"\xff\xff\xff\xff\5"
    assert decode(plan_of("a/B", text), payload, np.array([5]))["some"].tolist() == [0xFFFFFFFF]  # type: ignore[union-attr]


def test_types_whose_messages_are_larger_than_any_bag_allows_are_refused() -> None:
    text = f"a/C[100000] many\n{'=' * 80}\nMSG: a/C\nfloat64[100000] x\nstring s"
    with pytest.raises(DefinitionError, match="at least 80000400000 bytes; the limit is 1073741824"):
        plan_of("a/B", text)


def test_bytes_that_are_not_utf_8_are_replaced() -> None:
    euro = "€".encode()
    texts = [b"ok", b"\xff", euro[:1], euro[1:], euro]
    payloads = [len(each).to_bytes(4, "little") + each for each in texts]

    column = columns_of("std_msgs/String", payloads)["data"]

    expected = [each.decode(errors="replace") for each in texts]
    assert list(column) == list(column.valid()) == expected
    across = columns_of("std_msgs/String", payloads[2:4])["data"]  # together, they are valid
    assert list(across.valid()) == expected[2:4]


def test_times_are_nanoseconds_or_dates() -> None:
    payload = (5).to_bytes(4, "little") + (7).to_bytes(4, "little")
    assert columns_of("std_msgs/Time", [payload])["data"].tolist() == [5_000_000_007]
    date = columns_of("std_msgs/Time", [payload], datetimes=True)["data"]
    assert (str(date[0]), date.dtype.str) == ("1970-01-01T00:00:05.000000007", "<M8[ns]")
    past = columns_of("std_msgs/Duration", [(-3).to_bytes(4, "little", signed=True) + payload[4:]])["data"]
    assert past.tolist() == [-2_999_999_993]


def test_columns_are_sliced_and_taken() -> None:
    columns = columns_of("tf2_msgs/TFMessage", payloads_of("tf2_msgs/TFMessage", 30, seeded(7)))
    column = columns["transforms"]
    rows = [cell(column, row) for row in range(30)]

    assert [cell(column[5:9], row) for row in range(4)] == rows[5:9]
    some = column.take(np.array([7, 7, 2]))
    assert [cell(some, row) for row in range(3)] == [rows[7], rows[7], rows[2]]
    assert [cell(joined_columns([column[:4], column[20:]]), row) for row in range(14)] == rows[:4] + rows[20:]


@given(
    data=st.binary(min_size=1, max_size=5000),
    parts=st.lists(st.tuples(st.integers(0, 5000), st.sampled_from([0, 1, 3, 8, 24, 70, 1900]))),
    more=st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 60))),
)
def test_parts_of_all_sizes_are_joined_in_order(
    data: bytes, parts: list[tuple[int, int]], more: list[tuple[int, int]]
) -> None:
    array = np.frombuffer(data, np.uint8)
    bounds = [(min(at, len(data)), min(at + size, len(data))) for at, size in parts + more]
    starts, ends = np.array(bounds, np.int64).reshape(-1, 2).T
    joined = b"".join(data[begin:end] for begin, end in bounds)
    assert joined_parts(array, starts, ends - starts).tobytes() == joined
    out = np.empty(len(joined), np.uint8)
    assert joined_parts(array, starts, ends - starts, out=out) is out
    assert out.tobytes() == joined
