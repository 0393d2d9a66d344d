"""Queries of the buffer besides lookups: possible transforms, common times, chains."""

from __future__ import annotations

import math
import re

import pytest

from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.errors import (
    ConnectivityException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from pipros_libraries.transforms.pose import Pose, compose_via_matrices, inverted, normalized

S = 1_000_000_000


def at(x: float, yaw: float = 0.0) -> Pose:
    return (x, 0.0, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


@pytest.fixture
def buffer() -> TransformBuffer:
    """Moving map → odom → base → (left → camera, right), a static map → dock, and an unconnected frame."""
    made = TransformBuffer()
    chain = [("map", "odom"), ("odom", "base"), ("base", "left"), ("base", "right"), ("left", "camera")]
    for parent, child in chain:
        for second in (1, 2, 3):
            made.insert(parent, child, second * S, at(second), "me")
    made.insert("base", "right", 5 * S, at(5), "me")
    made.insert("map", "dock", 0, at(9), "me", is_static=True)
    made.insert("sea", "island", 2 * S, at(1), "me")
    return made


def test_possible_transforms_have_no_error(buffer: TransformBuffer) -> None:
    assert buffer.can_transform("map", "camera", 0) is None
    assert buffer.can_transform("camera", "map", 2 * S) is None
    assert buffer.can_transform("nowhere", "nowhere", 0) is None
    assert buffer.can_transform_full("camera", 3 * S, "right", S, "map") is None


@pytest.mark.parametrize(
    ("target", "source", "time", "reason"),
    [
        ("map", "nowhere", 0, "source_frame nowhere does not exist"),
        ("here", "nowhere", 0, "target_frame here does not exist. canTransform: source_frame nowhere"),
        ("map", "island", 0, "not part of the same tree"),
        ("map", "camera", 9 * S, "extrapolation .* into the future"),
        ("camera", "right", 4 * S, "extrapolation .* into the future"),
        ("right", "camera", 4 * S, "extrapolation .* into the future"),
        ("island", "map", S, "extrapolation at time"),
    ],
)
def test_the_error_about_a_transform_names_the_frame_or_time(
    buffer: TransformBuffer, target: str, source: str, time: int, reason: str
) -> None:
    assert re.search(reason, buffer.can_transform(target, source, time) or "")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("here", S, "nowhere", S, "map"), "target_frame here does not exist. canTransform: source_frame"),
        (("map", 2 * S, "camera", 2 * S, "island"), "same tree"),
        (("map", 9 * S, "camera", S, "odom"), "extrapolation"),
    ],
)
def test_the_error_about_a_transform_between_two_times(
    buffer: TransformBuffer, arguments: tuple[str, int, str, int, str], reason: str
) -> None:
    assert reason in str(buffer.can_transform_full(*arguments))


@pytest.mark.parametrize("name", ["", "/map"])
def test_an_invalid_frame_name_raises_even_in_queries(buffer: TransformBuffer, name: str) -> None:
    for target, source in ((name, "map"), ("map", name)):
        with pytest.raises(InvalidArgumentException):
            buffer.can_transform(target, source, 0)


@pytest.mark.parametrize(
    ("target", "source", "time"),
    [
        ("map", "camera", 3 * S),
        ("camera", "map", 3 * S),
        ("camera", "right", 3 * S),
        ("right", "base", 5 * S),
        ("right", "right", 5 * S),
        ("map", "map", 0),
        ("map", "dock", 0),
        ("dock", "camera", 3 * S),
    ],
)
def test_the_common_time_is_the_oldest_of_the_newest_on_the_path(
    buffer: TransformBuffer, target: str, source: str, time: int
) -> None:
    assert buffer.latest_common_time(target, source) == time


def test_frames_of_two_trees_have_no_common_time(buffer: TransformBuffer) -> None:
    with pytest.raises(TransformException, match="same tree"):
        buffer.latest_common_time("map", "island")
    with pytest.raises(LookupException, match='"nowhere" passed to get_latest_common_time'):
        buffer.latest_common_time("nowhere", "map")


@pytest.mark.parametrize("target", ["a", "z"])
def test_every_query_of_a_loop_ends(target: str) -> None:
    loop = TransformBuffer()
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a"), ("y", "z")):
        loop.insert(parent, child, S, at(1), "me")

    with pytest.raises(TransformException, match="loop"):
        loop.latest_common_time("z", "a")
    with pytest.raises(TransformException, match="loop"):
        loop.latest_common_time("a", "z")
    with pytest.raises(LookupException, match="loop"):
        loop.lookup("z", "b", S)
    with pytest.raises(LookupException, match="loop"):
        loop.lookup("b", "z", S)
    assert "loop" in str(loop.can_transform(target, "b" if target == "z" else "z", S))


def test_a_chain_of_unknown_or_unconnected_frames_is_an_error(buffer: TransformBuffer) -> None:
    with pytest.raises(LookupException):
        buffer.chain("right", S, "nowhere", S, "map")
    with pytest.raises(ConnectivityException):
        buffer.chain("island", 2 * S, "camera", 2 * S, "map")


def test_a_frame_in_itself_is_at_its_newest_time(buffer: TransformBuffer) -> None:
    assert buffer.lookup("right", "right", 0) == (5 * S, (0, 0, 0, 0, 0, 0, 1))
    assert buffer.lookup("nowhere", "nowhere", 7) == (7, (0, 0, 0, 0, 0, 0, 1))


def test_the_leading_slash_of_tf_is_removed() -> None:
    buffer = TransformBuffer()
    assert buffer.insert("/map", "/base", S, at(1), "me") == []
    assert buffer.frame_names() == ["base", "map"]


@pytest.mark.parametrize("yaw", [0.4, 3.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_exact_composition_gives_unit_quaternions(axis: int, yaw: float) -> None:
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(yaw / 2)
    turn: Pose = (1.0, 2.0, 3.0, half[0], half[1], half[2], math.cos(yaw / 2))

    assert compose_via_matrices(turn, inverted(turn)) == pytest.approx((0, 0, 0, 0, 0, 0, 1))
    same = normalized(turn)
    assert same == pytest.approx(turn) or same[3:] == pytest.approx([-part for part in turn[3:]])
