"""The conditions under which tf_change_notifier reports a frame."""

from __future__ import annotations

from typing import Any

import pytest

from pipros_libraries.transforms.change_filter import BadFramePair, FramePair, frame_pairs, frequency_of


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
        ("a b", "must be a list"),
        (["a"], "must be a mapping"),
        ([{"source_frame": "a"}], "target_frame"),
        ([{"source_frame": "", "target_frame": "b"}], "source_frame"),
        ([{"source_frame": 3, "target_frame": "b"}], "source_frame"),
        (
            [{"source_frame": "a", "target_frame": "b", "angular_update_distance": "far"}],
            "angular_update_distance",
        ),
        ([{"source_frame": "a", "target_frame": "b", "angular_update_distance": -1}], ">= 0"),
        ([{"source_frame": "a", "target_frame": "b", "angular_update_distance": float("nan")}], ">= 0"),
    ],
)
def test_invalid_pairs_are_named(value: Any, words: str) -> None:
    with pytest.raises(BadFramePair, match=words):
        frame_pairs(value, 0.1, 0.1)


@pytest.mark.parametrize("value", [0, -1, float("inf"), float("nan"), True, "10", None])
def test_a_frequency_must_be_a_finite_positive_number(value: Any) -> None:
    with pytest.raises(BadFramePair, match=r"^hz must be a finite number > 0, got "):
        frequency_of("hz", value)
