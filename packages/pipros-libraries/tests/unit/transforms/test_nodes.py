"""The arguments and the output of the programs of tf and tf2_ros."""

import math
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from genpy import Time
from pipros_libraries.transforms.change_filter import BadFramePair, FramePair, frame_pairs, frequency_of
from pipros_libraries.transforms.diagnose import (
    ReceivedTransform,
    loops,
    not_normalized,
    of_other_times,
    of_several_senders,
    received_in,
    reparented,
)
from pipros_libraries.transforms.formatting import pose_as_text
from pipros_libraries.transforms.monitor import FRAME_LIMIT, Monitor
from pipros_libraries.transforms.pose import from_roll_pitch_yaw, roll_pitch_yaw
from tf.nodes.tf_remap import mappings_of
from tf2_ros.nodes import echo
from tf2_ros.nodes.static_transform_publisher import transform_of, transform_of_param


def test_six_numbers_are_a_position_and_yaw_pitch_roll() -> None:
    found = transform_of(["1", "2", "3", str(math.pi / 2), "0", "0", "map", "base"])

    assert (found.header.frame_id, found.child_frame_id, found.transform.translation.y) == ("map", "base", 2)
    assert found.transform.rotation.z == pytest.approx(math.sqrt(0.5))


def test_seven_numbers_are_a_position_and_a_quaternion() -> None:
    assert transform_of(["1", "2", "3", "0", "0", "1", "0", "map", "base"]).transform.rotation.z == 1.0


@pytest.mark.parametrize("arguments", ["1 2 3", "1 2 3 4 5 6 7 8 a b", "x 2 3 0 0 0 a b"])
def test_wrong_arguments_are_refused(arguments: str) -> None:
    with pytest.raises(ValueError, match=r"number of arguments|could not convert"):
        transform_of(arguments.split())


def test_a_parameter_has_the_fields_of_the_message() -> None:
    value = {
        "header": {"frame_id": "map"},
        "child_frame_id": "base",
        "transform": {"translation": {"x": 1, "y": 2, "z": 3}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}},
    }

    assert transform_of_param(value).transform.translation.z == 3.0
    del value["child_frame_id"]
    with pytest.raises(ValueError, match="missing or invalid 'child_frame_id'"):
        transform_of_param(value)


@pytest.mark.parametrize("angles", [(0.1, 0.2, 0.3), (-3, 1.5, 2), (0, -1, 0)])
def test_euler_angles_survive_conversion(angles: tuple[float, float, float]) -> None:
    assert roll_pitch_yaw((0, 0, 0, *from_roll_pitch_yaw(*angles))) == pytest.approx(angles)


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_straight_up_is_one_of_many_answers(pitch: float) -> None:
    found = roll_pitch_yaw((0, 0, 0, *from_roll_pitch_yaw(0.3, pitch, 0.0)))

    again = from_roll_pitch_yaw(*found)
    expected = from_roll_pitch_yaw(0.3, pitch, 0.0)
    assert abs(sum(a * b for a, b in zip(again, expected, strict=True))) == pytest.approx(1.0)


def test_echo_prints_translation_and_rotation() -> None:
    assert pose_as_text((1, 2, 3, 0, 0, 0, 1)).splitlines()[:2] == [
        "- Translation: [1.000, 2.000, 3.000]",
        "- Rotation: in Quaternion [0.000, 0.000, 0.000, 1.000]",
    ]


def test_delays_and_rates_are_counted_by_frame_and_by_sender() -> None:
    monitor = Monitor()
    for second in range(5):
        monitor.add("/slam", {"odom": second - 0.5, "map": second - 0.25}, float(second))
        monitor.add("/wheels", {"base": second + 1.0}, second / 2)

    assert monitor.text(["base", "odom", "world"]).splitlines() == [
        "Frames:", "Frame: base published by /wheels Average Delay: -2 Max Delay: 0",
        "Frame: odom published by /slam Average Delay: 0.5 Max Delay: 0.5", "", "All Broadcasters:",
        "Node: /slam 1 Hz, Average Delay: 0.375 Max Delay: 0.375",
        "Node: /wheels 2 Hz, Average Delay: -2 Max Delay: 0",
    ]  # fmt: skip
    assert "Frame: map published by /slam" in monitor.text()
    assert Monitor().text() == "Frames:\n\nAll Broadcasters:"


def test_an_endless_number_of_frames_takes_bounded_memory() -> None:
    monitor = Monitor()
    monitor.add("/x", {f"f{number}": 0.0 for number in range(FRAME_LIMIT + 10)}, 1.0)

    assert len(monitor.frames) == FRAME_LIMIT == len(monitor.sender_of)


@pytest.mark.parametrize("wrong", [None, "x", {}, [1], [{"old": "a"}], [["a", "b"]]])
def test_a_mapping_of_frames_needs_both_names(wrong: object) -> None:
    assert mappings_of(wrong) == {}


@pytest.mark.parametrize(
    "wrong", [["a"], ["a", "b", "-r", "0"], ["a", "b", "-p", "-1"], ["a", "b", "-c", "nan"]]
)
def test_echo_refuses_wrong_arguments(wrong: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        echo._options(wrong)
    assert ended.value.code == 2


# Received transforms: every contradiction is reported once, and nothing else.


def received(
    parent: str, child: str, sender: str = "/base", *, ahead_s: float = 0.0, rotation_length: float = 1.0
) -> ReceivedTransform:
    return ReceivedTransform(parent, child, sender, ahead_s, rotation_length)


def test_a_publisher_without_a_caller_id_is_unknown() -> None:
    message = TFMessage([TransformStamped()])
    message._connection_header = {"type": TFMessage._type}
    assert [each.sender for each in received_in(message, Time())] == ["unknown_publisher"]


HEALTHY = [received("map", "odom", "/slam"), received("odom", "base_link"), received("map", "odom", "/slam")]


def test_nothing_is_found_in_a_healthy_tree() -> None:
    for check in (of_other_times, not_normalized, reparented, of_several_senders, loops):
        assert (check(HEALTHY), check([])) == ([], [])


def test_the_largest_clock_offset_of_each_sender_is_named() -> None:
    late = [received("a", "b", ahead_s=seconds) for seconds in (0.9, -3.0, 2.0)]
    assert of_other_times(late) == ["receiving transform from [/base] that differed from ROS time by -3.0s"]


def test_a_quaternion_of_another_length_is_named_once() -> None:
    found = not_normalized([received("a", "b", rotation_length=0.0)] * 3)
    assert found == ["rotation from [a] to [b] is not unit length, 0.0"]


def test_each_change_of_parent_is_named_once() -> None:
    assert reparented([received("map", "odom"), received("world", "odom")] * 3) == [
        "reparenting of [odom] to [world] by [/base]",
        "reparenting of [odom] to [map] by [/base]",
    ]


def test_each_change_of_sender_is_named_once() -> None:
    assert of_several_senders([received("map", "odom", "/one"), received("map", "odom", "/other")] * 2) == [
        "node [/other] publishing transform [odom] with parent [map] already published by node [/one]",
        "node [/one] publishing transform [odom] with parent [map] already published by node [/other]",
    ]


def test_each_frame_of_a_loop_is_named_and_those_below_it_are_not() -> None:
    found = loops([received("a", "b"), received("b", "a"), received("a", "leaf"), received("own", "own")])
    assert found == [
        "Frame b is in a loop. It's loop has elements:\nb -> a",
        "Frame a is in a loop. It's loop has elements:\na -> b",
        "Frame own is in a loop. It's loop has elements:\nown",
    ]


def test_names_of_peers_cannot_forge_lines() -> None:
    (found,) = not_normalized([received("a", "b\nERROR", rotation_length=2.0)])
    assert "\n" not in found


def test_a_quaternion_with_nan_is_not_a_rotation() -> None:
    (found,) = not_normalized([received("a", "b", rotation_length=math.nan)])
    assert found.endswith("is not unit length, nan")


# The conditions under which tf_change_notifier reports a frame.


def test_the_first_pose_and_each_distant_one_are_reported() -> None:
    pair = FramePair("hand", "map", 0.1, 0.1)
    places = [0.0, 0.06, 0.12, 0.18, 0.25]
    assert [pair.has_moved((x, 0, 0, 0, 0, 0, 1)) for x in places] == [True, False, True, False, True]


def test_a_quaternion_of_zeros_does_not_rotate() -> None:
    pair = FramePair("hand", "map", 0.1, 0.1)
    assert pair.has_moved((0, 0, 0, 0, 0, 0, 0))
    assert not pair.has_moved((0, 0, 0, 0, 0, 0, 1))


def test_pairs_have_their_own_distances_or_those_of_the_node() -> None:
    names = {"source_frame": "a", "target_frame": "b"}
    pairs = frame_pairs([names, {**names, "translational_update_distance": 2}], 0.5, 0.25)
    assert [(pair.distance, pair.angle) for pair in pairs] == [(0.5, 0.25), (2.0, 0.25)]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("a b", "must be a list"), (["a"], "must be a mapping"), ([{"source_frame": "a"}], "target_frame"),
        ([{"source_frame": "", "target_frame": "b"}], "source_frame"),
        ([{"source_frame": 3, "target_frame": "b"}], "source_frame"),
        (
            [{"source_frame": "a", "target_frame": "b", "angular_update_distance": "far"}],
            "angular_update_distance",
        ),
        ([{"source_frame": "a", "target_frame": "b", "angular_update_distance": -1}], ">= 0"),
        ([{"source_frame": "a", "target_frame": "b", "angular_update_distance": float("nan")}], ">= 0"),
    ],
)  # fmt: skip
def test_invalid_pairs_are_named(value: Any, words: str) -> None:
    with pytest.raises(BadFramePair, match=words):
        frame_pairs(value, 0.1, 0.1)


@pytest.mark.parametrize("value", [0, -1, float("inf"), float("nan"), True, "10", None])
def test_a_frequency_must_be_a_finite_positive_number(value: Any) -> None:
    with pytest.raises(BadFramePair, match=r"^hz must be a finite number > 0, got "):
        frequency_of("hz", value)
