"""Samples of curves: expressions, times, marks, and curves of whole bags."""

import math
import struct
import time
from contextvars import copy_context
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped, Pose, Quaternion, Vector3
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64, Header

from pipros.basics.errors import NotFound
from pipros.msg.time import Time
from pipros.safe.expr_walk import ExpressionError
from pipros_page.bags.curve import MAX_SAMPLES, BagSamples
from pipros_page.curve_samples import (
    Axis,
    CurveField,
    NotANumber,
    find_field,
    mark_of,
    number_in,
    numeric_fields,
    sample_of,
)
from pipros_page.views import plot
from pipros_server.browser_share import set_current_browser
from pipros_tools.bag import BagReader, BagWriter


def field_of(text: str) -> CurveField:
    found = find_field(text, {"/vector": "geometry_msgs/Vector3", "/point": "geometry_msgs/PointStamped"})
    assert found is not None
    return found


@pytest.mark.parametrize(("expression", "value"), [
    ("m.x + m.y", 3.0), ("hypot(m.x, m.y) > 2", 1.0), ("m.x * inf", None), ("10 ** 400", None)
])  # fmt: skip
def test_expressions_over_messages_are_numbers(expression: str, value: float | None) -> None:
    sample = sample_of(Vector3(1, 2, 3), field_of(f"/vector={expression}"), Axis.RECEIVED, 7.0, 8.0)
    assert sample == [7.0, value]


@pytest.mark.parametrize("value", [2**64 - 1, -(2**53) - 1])
def test_integers_that_javascript_rounds_are_sent_as_text_too(value: int) -> None:
    for text in (f"/vector={value}", f"/vector=int(m.x) + {value}"):
        sample = sample_of(Vector3(0, 0, 0), field_of(text), Axis.RECEIVED, 7.0, 8.0)
        assert sample == [7.0, float(value), str(value)]
    assert sample_of(Vector3(), field_of(f"/vector={2**53}"), Axis.RECEIVED, 7.0, 8.0) == [7.0, 2.0**53]


def test_expressions_that_are_not_numbers_are_refused() -> None:
    with pytest.raises(NotANumber, match="must be a number, got str"):
        sample_of(Vector3(), field_of("/vector=str(m.x)"), Axis.RECEIVED, 0.0, 0.0)
    with pytest.raises(ExpressionError, match=r"no field \[w\]"):
        sample_of(Vector3(), field_of("/vector=m.w"), Axis.RECEIVED, 0.0, 0.0)
    with pytest.raises(ExpressionError):
        field_of("/vector=m.x +")
    assert find_field("/nothing=m.x", {"/vector": "geometry_msgs/Vector3"}) is None


@pytest.mark.parametrize(("text", "holds", "value"), [
    ('/point{m.header.frame_id == "map" and m.point.x < 9}/point/y', True, 2.0),
    ("/point{m.header.frame_id == 'a}='}/point/y", False, 2.0),
    ("/point{m.point.z}=m.point.x * 10", True, 10.0),
])  # fmt: skip
def test_a_condition_selects_messages(text: str, holds: bool, value: float) -> None:
    field = field_of(text)
    point = PointStamped(header=Header(frame_id="map"))
    point.point.x, point.point.y, point.point.z = 1.0, 2.0, 3.0
    assert (field.topic, field.text, field.holds(point)) == ("/point", text, holds)
    assert number_in(point, field) == value
    assert field.has_expression


def test_a_malformed_condition_is_refused() -> None:
    with pytest.raises(ExpressionError):
        field_of("/point{m.point.x <}/point/y")
    with pytest.raises(ExpressionError, match=r"no field \[w\]"):
        field_of("/point{m.w}/point/y").holds(PointStamped())
    assert find_field("/nothing{m.x}/x", {"/point": "geometry_msgs/PointStamped"}) is None


def test_quaternions_have_angles_in_degrees() -> None:
    topics = {"/pose": "geometry_msgs/Pose", "/vector": "geometry_msgs/Vector3"}

    def number(message: Any, text: str) -> float | None:
        field = find_field(text, topics)
        assert field is not None
        return number_in(message, field)

    turned = Pose(orientation=Quaternion(z=math.sqrt(2), w=math.sqrt(2)))
    angles = [number(turned, f"/pose/orientation/{name}_deg") for name in ("roll", "pitch", "yaw")]
    assert angles == pytest.approx([0.0, 0.0, 90.0])
    assert number(Pose(orientation=Quaternion()), "/pose/orientation/yaw_deg") is None
    assert "orientation/yaw_deg" in list(numeric_fields(turned))
    with pytest.raises(NotFound):
        number(Vector3(), "/vector/yaw_deg")


def test_samples_are_on_the_chosen_time_axis() -> None:
    point = PointStamped(header=Header(stamp=Time(5, 250_000_000)))
    times = [sample_of(point, field_of("/point/point/x"), axis, 7.0, 8.0)[0] for axis in Axis]
    assert times == [7.0, 5.25, 8.0]
    with pytest.raises(ValueError, match="have no header"):
        sample_of(Vector3(), field_of("/vector/x"), Axis.STAMP, 7.0, 8.0)


def test_only_warnings_and_errors_are_marked() -> None:
    assert mark_of(Log(level=Log.INFO), Axis.RECEIVED, 1.0, 2.0) is None
    entry = Log(level=Log.ERROR, name="/arm", msg="x" * 1000)
    mark = mark_of(entry, Axis.ROS, 1.0, 2.0)
    assert (mark[:2], mark[2][:10], len(mark[2])) == ([2.0, 8], "/arm: xxxx", 200)


def test_a_long_bag_has_evenly_spaced_samples(tmp_path: Path) -> None:
    count = 2 * MAX_SAMPLES + 10
    with (tmp_path / "a.bag").open("wb") as file:
        bag = BagWriter(file)
        fields = {"type": Float64._type, "md5sum": Float64._md5sum, "message_definition": Float64._full_text}
        header = {"topic": b"/a", **{name: text.encode() for name, text in fields.items()}}
        added = bag.add_connection("/a", header)
        for number in range(count):
            bag.write(added, 1000 + number, 0, struct.pack("<d", number))
        bag.finish()
    with BagReader(tmp_path / "a.bag") as reader:
        curve = BagSamples(reader, reader.connections, lambda message, time_s: [time_s, message.data])
        samples = []
        while (piece := curve.next_piece()) is not None:
            samples += piece[0]
    assert samples[:3] == [[1000.0, 0.0], [1003.0, 3.0], [1006.0, 6.0]]
    assert len(samples) == math.ceil(count / 3)
    assert curve.left_out == count - len(samples)


def test_messages_that_cannot_be_shown_are_named(tmp_path: Path) -> None:
    with (tmp_path / "a.bag").open("wb") as file:
        bag = BagWriter(file)
        kind = {"type": b"std_msgs/Float64", "md5sum": b"0" * 32, "message_definition": b"%"}
        bag.write(bag.add_connection("/a", {"topic": b"/a", **kind}), 1, 0, b"")
        bag.finish()
    with BagReader(tmp_path / "a.bag") as reader:
        piece = BagSamples(reader, reader.connections, lambda *_: None).next_piece()
    assert piece[0] == []
    assert piece[1]


# The plots of one browser may not use up the threads that receive messages for all browsers.


def test_plots_of_a_browser_share_the_time_for_computing(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr(time, "thread_time", lambda: now_s)
    monkeypatch.setattr(time, "monotonic", lambda: 7.0)
    decoded = []

    def decode(message: Any) -> Any:
        nonlocal now_s
        now_s += 0.1
        decoded.append(message)
        return message

    def curve() -> Any:
        watch: Any = SimpleNamespace(decode=decode, topic="/a")
        return plot._Curve(watch, find_field("/a/data", {"/a": ""}), Axis.RECEIVED, plot._RosTime())

    greedy, other = copy_context(), copy_context()
    greedy.run(set_current_browser)
    other.run(set_current_browser)
    for each in [greedy.run(curve) for _ in range(50)]:
        each.add(Float64(1.0), 1.0)
    assert len(decoded) == 6
    other.run(curve).add(Float64(2.0), 1.0)
    assert decoded[-1].data == 2.0
