import math
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_tools.graph.measurements import NO_NEW_MESSAGES, Rates, as_bytes
from pipros_tools.graph.message_filter import MessageFilter
from pipros_tools.graph.samples import BandwidthWindow, RateWindow, Samples
from pipros_tools.graph.value_statistics import FIELDS, numbers_in, summaries


def test_figures_of_samples() -> None:
    samples = Samples()
    for value in (1.0, 2.0, 3.0):
        samples.add(value)
    figures = samples.figures()
    assert (figures.mean, figures.minimum, figures.maximum, figures.count) == (2.0, 1.0, 3.0, 3)
    assert figures.deviation == pytest.approx((2 / 3) ** 0.5)


def test_only_the_newest_samples_count() -> None:
    samples = Samples(window=2)
    for value in (100.0, 1.0, 3.0):
        samples.add(value)
    figures = samples.figures()
    assert figures.mean == 2.0


def test_no_samples_have_no_statistics() -> None:
    assert Samples().figures() is None
    assert RateWindow().figures() is None
    assert BandwidthWindow().figures(1.0) is None


def test_a_rate_needs_two_distinct_times_and_is_reset_when_time_goes_back() -> None:
    rate = RateWindow()
    for moment in (100.0, 101.0, 101.0):  # equal times are no way back
        assert rate.add(moment)
    assert not rate.add(1.0)
    assert rate.figures() is None
    rate.add(1.5)
    figures = rate.figures()
    assert (figures.mean, figures.count) == (0.5, 2)


def test_a_rate_with_a_window_of_one_never_has_figures() -> None:
    rate = RateWindow(window=1)
    rate.add(1.0)
    rate.add(2.0)
    assert rate.figures() is None


def test_bandwidth_is_bytes_until_now_by_the_time_since_the_first() -> None:
    bandwidth = BandwidthWindow(window=10)
    bandwidth.add(0.0, 100)
    assert bandwidth.figures(1.0) is None
    bandwidth.add(1.0, 300)
    found = bandwidth.figures(2.0)
    assert found is not None
    per_second, sizes = found
    assert (per_second, sizes.mean, sizes.minimum, sizes.maximum) == (200.0, 200.0, 100, 300)


@pytest.mark.parametrize(("size", "text"), [
    (9, "9.00B"), (999, "999.00B"), (3004, "3.00KB"), (120_004, "0.12MB"), (2_410_000, "2.41MB")
])  # fmt: skip
def test_sizes_are_printed_as_ros_prints_them(size: float, text: str) -> None:
    assert as_bytes(size) == text


def test_a_report_of_one_topic() -> None:
    rates = Rates(["/a"], say=print)
    assert rates.report() == NO_NEW_MESSAGES
    for moment in (0.0, 0.05, 0.1):
        rates.add("/a", moment)
    assert rates.has_new()
    assert rates.report() == ("average rate: 20.000\n\tmin: 0.050s max: 0.050s std dev: 0.00000s window: 3")
    assert rates.report() == NO_NEW_MESSAGES


def test_a_report_of_several_topics_is_a_table_of_active_ones() -> None:
    rates = Rates(["/fast", "/stamped", "/silent"], say=print)
    for moment in (0.0, 0.05, 0.1):
        rates.add("/fast", moment)
    for moment in (0.0, 0.2, 0.3996):
        rates.add("/stamped", moment)
    assert rates.report() == (
        " topic      rate   min_delta   max_delta   std_dev   window\n"
        "===========================================================\n"
        "/fast      20.0    0.05        0.05        0.0       3     \n"
        "/stamped   5.005   0.1996      0.2         0.0002    3     \n"
    )


def test_a_jump_back_of_time_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    rates = Rates(["/a"], say=print)
    rates.add("/a", 5.0)
    rates.add("/a", 4.0)
    assert capsys.readouterr().out == "time has reset, resetting counters\n"


# Statistics of the numbers in messages.


Odometry: Any = load_message_class("nav_msgs/Odometry")
LaserScan: Any = load_message_class("sensor_msgs/LaserScan")
Float64: Any = load_message_class("std_msgs/Float64")


def test_fields_are_named_with_dots_and_arrays_have_one_name() -> None:
    names = [name for name, _ in numbers_in(LaserScan(ranges=[1.0, 2.0]))]
    assert names.count("ranges[]") == 2
    assert "header.stamp" in names
    assert {"pose.covariance[]", "pose.pose.position.x"} <= {name for name, _ in numbers_in(Odometry())}


def test_statistics_leave_out_what_is_not_finite() -> None:
    [row] = summaries([Float64(each) for each in (1.0, math.nan, 3.0, math.inf)])
    assert row == {
        "field": "data", "values": 2, "not_finite": 2, "min": 1.0, "max": 3.0, "mean": 2.0, "deviation": 1.0,
        "first": 1.0, "last": 3.0,
    }  # fmt: skip
    assert summaries([math.nan]) == [{"field": "value", "values": 0, "not_finite": 1}]


def test_large_numbers_keep_their_deviation() -> None:
    [row] = summaries([1.7e9, 1.7e9 + 1.0])
    assert row["deviation"] == pytest.approx(0.5)
    assert row["mean"] == 1.7e9 + 0.5


def test_texts_have_no_statistics_and_fields_are_limited() -> None:
    assert (summaries(["a text", b"bytes"]), len(summaries([[[[each]] for each in range(3)]]))) == ([], 1)
    many = type("Many", (), {"__slots__": [f"f{n}" for n in range(FIELDS + 9)], "_slot_types": []})()
    for name in many.__slots__:
        setattr(many, name, 1.0)
    assert len(summaries([many])) == FIELDS


# `--filter`: the messages that an expression selects, and the fields that it can read.


Pose = load_message_class("geometry_msgs/PoseStamped")


def pose(x: float) -> object:
    message = Pose()
    message.pose.position.x = x  # type: ignore[attr-defined]
    message.header.stamp = Time(3, 500_000_000)  # type: ignore[attr-defined]
    return message


@pytest.mark.parametrize(("expression", "selected"), [
    ("m.pose.position.x > 1", [2.0, 3.0]), ("m.pose.position.x in (1, 3)", [1.0, 3.0]),
    ("m.header.stamp.secs == 3 and topic == '/goal'", [1.0, 2.0, 3.0]),
    ("m.header.stamp.to_sec() > 3.4", [1.0, 2.0, 3.0]),
    ("m._type == 'geometry_msgs/PoseStamped'", [1.0, 2.0, 3.0]), ("False", []),
])  # fmt: skip
def test_an_expression_selects(expression: str, selected: list[float]) -> None:
    passes = MessageFilter(expression)

    assert [x for x in (1.0, 2.0, 3.0) if passes(pose(x), "/goal")] == selected


def test_each_reason_of_a_failure_is_reported_once() -> None:
    complaints: list[str] = []
    passes = MessageFilter("m.speed > 1", complain=complaints.append)

    assert [passes(pose(x), "/goal") for x in (1.0, 2.0)] == [False, False]
    assert len(complaints) == 1
    assert "has no field [speed]" in complaints[0]
