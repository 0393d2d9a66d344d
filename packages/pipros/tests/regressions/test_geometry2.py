"""Reported faults of geometry2 and diagnostics."""

import io
import logging
import shutil
import subprocess
from collections.abc import Iterable
from typing import Any

import pytest
import yaml
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

import rospy
import tf2_ros
from pipros.basics.limits import process_limits
from pipros.msg.time import Time
from pipros.node.clock import SimulatedClock
from pipros_libraries.diagnostics.aggregation import Aggregation
from pipros_libraries.diagnostics.items import OK, STALE, ComponentStatus
from pipros_libraries.transforms import rejections
from pipros_libraries.transforms.listener import TransformListener

# geometry2#467: a transform repeated with the same stamp printed a warning for each message.


def repeated(stamp_s: int, x: float, child: str = "base") -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.header.stamp = "map", rospy.Time(stamp_s)
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return made


def test_repeated_transforms_are_reported_once_in_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    buffer, shown = tf2_ros.BufferCore(rospy.Duration(10)), io.StringIO()
    monkeypatch.setattr(tf2_ros.BufferCore, "_warning_stream", shown)
    for number in range(300):
        buffer.set_transform(repeated(5, number), "driver")
    buffer.set_transform(repeated(5, 0, "arm"), "driver")
    buffer.set_transform(repeated(5, 0, "arm"), "driver")
    buffer.set_transform(repeated(20, 1), "driver")
    buffer.set_transform(repeated(1, 1), "driver")

    assert [(line.split()[1], line.split()[8]) for line in shown.getvalue().splitlines()[:2]] == [
        ("TF_REPEATED_DATA", "frame"), ("TF_REPEATED_DATA", "frame"),
    ]  # fmt: skip
    assert [line.split()[1] for line in shown.getvalue().splitlines()] == [
        *("TF_REPEATED_DATA", "TF_REPEATED_DATA", "TF_OLD_DATA")
    ]
    assert buffer.lookup_transform_core("map", "arm", rospy.Time(5)).transform.translation.x == 0


def test_the_next_warning_says_how_many_were_not_shown() -> None:
    now_s, shown = [0.0], list[str]()
    rejected = rejections.Rejections(shown.append, lambda: now_s[0])
    for _ in range(50):
        rejected.add("base", "TF_REPEATED_DATA again")
    now_s[0] = rejections.PERIOD_S
    rejected.add("base", "TF_REPEATED_DATA again")
    for number in range(5000):  # names of frames come from peers
        rejected.add(f"frame{number}", "TF_SELF_TRANSFORM x")
    assert shown[:2] == [
        "TF_REPEATED_DATA again", "TF_REPEATED_DATA again (and 49 more since the last warning)",
    ]  # fmt: skip
    assert len(rejected._quiet) <= 1000


# geometry2#559: the error about a missing fixed frame named another frame.


def test_the_error_names_the_fixed_frame() -> None:
    buffer = tf2_ros.BufferCore(rospy.Duration(10))
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "map", "base"
    transform.transform.rotation.w = 1
    buffer.set_transform_static(transform, "test")
    at = rospy.Time(1)
    for frames, missing in (
        (("map", "base", "gone"), "fixed_frame"), (("map", "gone", "map"), "source_frame"),
    ):  # fmt: skip
        target, source, fixed = frames
        with pytest.raises(
            tf2_ros.LookupException, match=f'"gone" passed to lookupTransform argument {missing}'
        ):
            buffer.lookup_transform_full_core(target, at, source, at, fixed)


# geometry2: a loop of frames or a very long chain of them blocked or crashed the lookups of all others.


def buffer(edges: Iterable[tuple[str, str]]) -> tf2_ros.BufferCore:
    made = tf2_ros.BufferCore(rospy.Duration(10))
    for parent, child in edges:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = parent, rospy.Time(5)
        transform.transform.translation.x = transform.transform.rotation.w = 1.0
        made.set_transform(transform, "test")
    return made


def test_a_loop_is_an_error_for_what_depends_on_it_only() -> None:
    made = buffer([("a", "b"), ("b", "c"), ("c", "a"), ("map", "base"), ("base", "laser")])
    with pytest.raises(tf2_ros.LookupException, match="contains a loop"):
        made.lookup_transform_core("map", "a", rospy.Time(0))
    found = made.lookup_transform_core("map", "laser", rospy.Time(0))
    assert found.transform.translation.x == 2.0


@pytest.mark.parametrize(("length", "is_found"), [(1000, True), (1500, False)])
def test_chains_of_a_thousand_frames_are_followed(length: int, is_found: bool) -> None:
    made = buffer((f"f{number}", f"f{number + 1}") for number in range(length))
    assert made.can_transform_core("f0", f"f{length}", rospy.Time(0))[0] == is_found
    assert made.can_transform_core("f0", "f1", rospy.Time(0))[0]


# geometry2: one frame with an odd name, and tools could not read or draw the whole tree.


NAMES = [
    *("cart: left", "joe's robot", 'arm "b"', "a\\b", "1", "-", "no", "Null", "~", "1e3", "{x}", "# c"),
    *("a\nb", "küche", "robot1/base_link", "base.link-2", "🤖", " gap ", "*x", "2020-01-01", "."),
]


@pytest.fixture
def odd_buffer() -> tf2_ros.BufferCore:
    made = tf2_ros.BufferCore(rospy.Duration(10))
    for parent, child in zip(["map", *NAMES], NAMES, strict=False):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.transform.rotation.w = parent, 1.0
        made.set_transform(transform, "/it's")
    return made


def test_the_yaml_of_all_frames_has_each_name(odd_buffer: tf2_ros.BufferCore) -> None:
    text = odd_buffer.all_frames_as_yaml()
    rows = yaml.safe_load(text)
    assert list(rows) == NAMES
    assert [row["parent"] for row in rows.values()] == ["map", *NAMES[:-1]]
    assert {row["broadcaster"] for row in rows.values()} == {"/it's"}
    assert "\nrobot1/base_link: \n  parent: 'küche'\n" in text  # as in tf2


def test_graphviz_draws_each_name(odd_buffer: tf2_ros.BufferCore) -> None:
    text = odd_buffer._allFramesAsDot()
    assert '"joe\'s robot" -> "arm \\"b\\""[' in text
    assert '"arm \\"b\\"" -> "a\\\\b"[' in text
    if dot := shutil.which("dot"):
        subprocess.run([dot, "-Tplain"], input=text.encode(), stdout=subprocess.DEVNULL, check=True)


# geometry2: after a reset of the simulator or a loop of a bag, robots stood where they had been before.


S = 1_000_000_000


class Robot:
    """A node whose time is simulated, and which receives what `send` sends."""

    def __init__(self) -> None:
        self.limits, self.log, self.clock = process_limits(), logging.Logger("robot"), SimulatedClock()
        self.callbacks: dict[str, Any] = {}
        self.transforms: Any = TransformListener(self)  # type: ignore[arg-type] # all that it uses is here

    def subscribe(self, topic: str, _: Any, callback: Any, **__: Any) -> None:
        self.callbacks[topic] = callback

    def send(self, stamp_s: float, x: float, topic: str = "/tf", child: str = "base") -> None:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id, transform.header.stamp = "odom", Time.from_sec(stamp_s)
        transform.transform.translation.x, transform.transform.rotation.w = x, 1.0
        self.callbacks[topic](TFMessage([transform]))

    def x(self, child: str = "base") -> float:
        return float(self.transforms.at("odom", child, 0)[0])


@pytest.mark.parametrize("late", [0, 1, 5])
def test_poses_from_before_a_reset_are_forgotten(late: int) -> None:
    robot = Robot()
    robot.clock.set_ns(100 * S)
    robot.send(0, 7.0, "/tf_static", "laser")
    robot.send(100, 1.0)
    robot.clock.set_ns(2 * S)
    for number in range(late):  # sent before the reset, received after it
        robot.send(99.5 + 0.1 * number, 1.0)
    robot.send(2.1, 2.0)
    assert (robot.x(), robot.x("laser")) == (2.0, 7.0)


def test_a_computer_whose_clock_is_ahead_is_still_heard_after_a_reset() -> None:
    robot = Robot()
    robot.clock.set_ns(100 * S)
    robot.send(100, 1.0)
    robot.clock.set_ns(2 * S)
    for number in range(1, 9):
        robot.send(1000 + number, number)
    assert robot.x() == 8.0


# diagnostics: a component that died as the simulated time was set back stayed OK for the time so far.


def test_a_component_that_is_silent_since_a_reset_is_stale() -> None:
    chosen = {"type": "GenericAnalyzer", "path": "A", "contains": ["dead", "alive"], "timeout": 5}
    aggregation = Aggregation("", {"a": chosen})
    for name in ("dead", "alive"):
        aggregation.take(ComponentStatus(name, OK, ""), 100.0)
    aggregation.take(ComponentStatus("alive", OK, ""), 2.0)
    levels = {each.name: each.level for each in aggregation.report(2.0)}
    assert (levels["/A/dead"], levels["/A/alive"]) == (STALE, OK)
