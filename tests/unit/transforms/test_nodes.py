"""What the programs of tf and tf2_ros read and print."""

from __future__ import annotations

import math

import pytest

from pipros.transforms.pose import from_roll_pitch_yaw, roll_pitch_yaw
from tf.nodes.tf_echo import text_of
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
    with pytest.raises(ValueError, match="lacks 'child_frame_id'"):
        transform_of_param(value)


@pytest.mark.parametrize("angles", [(0.1, 0.2, 0.3), (-3, 1.5, 2), (0, -1, 0)])
def test_angles_come_back(angles: tuple[float, float, float]) -> None:
    assert roll_pitch_yaw((0, 0, 0, *from_roll_pitch_yaw(*angles))) == pytest.approx(angles)


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_straight_up_is_one_of_many_answers(pitch: float) -> None:
    found = roll_pitch_yaw((0, 0, 0, *from_roll_pitch_yaw(0.3, pitch, 0.0)))

    again = from_roll_pitch_yaw(*found)
    expected = from_roll_pitch_yaw(0.3, pitch, 0.0)
    assert abs(sum(a * b for a, b in zip(again, expected, strict=True))) == pytest.approx(1.0)


def test_what_is_echoed() -> None:
    assert text_of(5.0, (1, 2, 3), (0, 0, 0, 1)).splitlines()[:3] == [
        "At time 5.000",
        "- Translation: [1.000, 2.000, 3.000]",
        "- Rotation: in Quaternion [0.000, 0.000, 0.000, 1.000]",
    ]
