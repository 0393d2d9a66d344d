"""The arguments and the output of the programs of tf and tf2_ros."""

from __future__ import annotations

import math

import pytest

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
        "Frames:",
        "Frame: base published by /wheels Average Delay: -2 Max Delay: 0",
        "Frame: odom published by /slam Average Delay: 0.5 Max Delay: 0.5",
        "",
        "All Broadcasters:",
        "Node: /slam 1 Hz, Average Delay: 0.375 Max Delay: 0.375",
        "Node: /wheels 2 Hz, Average Delay: -2 Max Delay: 0",
    ]
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
