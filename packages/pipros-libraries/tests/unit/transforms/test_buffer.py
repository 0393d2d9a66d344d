"""The buffer of frames over time."""

import math
import re

import pytest

from pipros_libraries.transforms.buffer import TransformBuffer
from pipros_libraries.transforms.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from pipros_libraries.transforms.pose import Pose, compose_via_matrices, inverted, normalized
from tests.support.constants import Constants

S = 1_000_000_000


def at(x: float, yaw: float = 0.0) -> Pose:
    return (x, 0.0, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


@pytest.fixture
def buffer() -> TransformBuffer:
    """Moving frames map → base → arm, and a static arm → hand."""
    made = TransformBuffer()
    for second in range(1, 6):
        made.insert("map", "base", second * S, at(second), "me")
        made.insert("base", "arm", second * S, at(10, yaw=second * math.pi / 10), "me")
    made.insert("arm", "hand", 0, at(0.5), "me", is_static=True)
    return made


def test_between_two_stamps_a_frame_is_in_between(buffer: TransformBuffer) -> None:
    time, pose = buffer.lookup("map", "base", int(2.25 * S))

    assert time == int(2.25 * S)
    assert pose == pytest.approx(at(2.25))
    assert buffer.lookup("base", "arm", int(2.5 * S))[1] == pytest.approx(at(10, yaw=math.pi / 4))


def test_a_transform_and_its_inverse_return_the_original(buffer: TransformBuffer) -> None:
    _, there = buffer.lookup("map", "hand", 3 * S)
    _, back = buffer.lookup("hand", "map", 3 * S)

    angle = 3 * math.pi / 10
    assert there[:3] == pytest.approx((13 + 0.5 * math.cos(angle), 0.5 * math.sin(angle), 0))
    assert back[5] == pytest.approx(-there[5])


def test_the_latest_time_is_common_to_all_frames(buffer: TransformBuffer) -> None:
    buffer.insert("map", "base", 7 * S, at(7), "me")

    assert (buffer.lookup("map", "hand", 0)[0], buffer.latest_common_time("map", "hand")) == (5 * S, 5 * S)
    assert buffer.lookup("arm", "hand", 0)[0] == 0


def test_two_times_are_joined_by_a_fixed_frame(buffer: TransformBuffer) -> None:
    time, pose = buffer.lookup_full("base", 4 * S, "base", 2 * S, "map")

    assert time == 4 * S
    assert pose == pytest.approx(at(-2))


@pytest.mark.parametrize(("target", "source", "time", "error", "words"), [
    ("map", "arm", 9 * S, ExtrapolationException, "4.000000000s into the future"),
    ("map", "arm", S // 2, ExtrapolationException, "0.500000000s into the past"),
    ("map", "nowhere", 0, LookupException, '"nowhere" passed to lookupTransform argument source_frame'),
    ("nowhere", "map", 0, LookupException, "argument target_frame does not exist"),
    ("moon", "map", 0, ConnectivityException, "two or more unconnected trees"),
    ("", "map", 0, InvalidArgumentException, "cannot be empty"),
    ("map", "/base", 0, InvalidArgumentException, "cannot start with a '/'"),
])  # fmt: skip
def test_unanswerable_lookups_are_errors(
    buffer: TransformBuffer, target: str, source: str, time: int, error: type[TransformException], words: str
) -> None:
    buffer.insert("sun", "moon", 3 * S, at(1), "me")

    with pytest.raises(error) as raised:
        buffer.lookup(target, source, time)

    assert words in str(raised.value)
    if error is InvalidArgumentException:
        with pytest.raises(error):
            buffer.can_transform(target, source, time)
    else:
        assert buffer.can_transform(target, source, time)


@pytest.mark.parametrize(("parent", "child", "pose", "word"), [
    ("map", "map", at(1), "TF_SELF_TRANSFORM"), ("", "x", at(1), "TF_NO_FRAME_ID"),
    ("map", "/", at(1), "TF_NO_CHILD_FRAME_ID"), ("map", "x", at(math.nan), "TF_NAN_INPUT"),
    ("map", "x", (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), "TF_DENORMALIZED_QUATERNION"),
    ("map", "x", (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.2), "TF_DENORMALIZED_QUATERNION"),
    ("map", "x", (0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 1.0), "TF_DENORMALIZED_QUATERNION"),
    ("map", "x", (0.0, 0.0, 0.0, 1e308, 1e308, 0.0, 1.0), "TF_DENORMALIZED_QUATERNION"),
])  # fmt: skip
def test_invalid_transforms_are_refused(
    buffer: TransformBuffer, parent: str, child: str, pose: Pose, word: str
) -> None:
    refused = buffer.insert(parent, child, S, pose, "me")

    assert any(text.startswith(word) for text in refused)
    assert buffer.frame_names() == ["base", "map", "arm", "hand"]


def test_a_time_before_zero_is_refused(buffer: TransformBuffer) -> None:
    for is_static in (False, True):
        (refused,) = buffer.insert("map", "x", -1, at(1), "me", is_static)
        assert "TF_NEGATIVE_TIME: the stamp of 'x' must be >= 0" in refused
    with pytest.raises(LookupException):
        buffer.lookup("map", "x", 0)


def test_old_and_repeated_stamps_are_refused(buffer: TransformBuffer) -> None:
    assert "TF_REPEATED_DATA" in buffer.insert("map", "base", 3 * S, at(9), "me")[0]
    buffer.insert("map", "base", 20 * S, at(9), "me")

    assert "TF_OLD_DATA" in buffer.insert("map", "base", 9 * S, at(9), "me")[0]
    with pytest.raises(ExtrapolationException, match="only time 20"):
        buffer.lookup("map", "base", 5 * S)


def test_a_late_transform_is_inserted_by_its_stamp(buffer: TransformBuffer) -> None:
    assert buffer.insert("map", "base", int(2.5 * S), at(20), "me") == []

    assert buffer.lookup("map", "base", int(2.25 * S))[1] == pytest.approx(at(11))


def test_a_frame_that_changes_its_parent_stays_where_it_was_until_then(buffer: TransformBuffer) -> None:
    buffer.insert("arm", "cup", 2 * S, at(1), "me")
    buffer.insert("map", "cup", 4 * S, at(50), "me")

    assert buffer.lookup("arm", "cup", 3 * S)[1] == pytest.approx(at(1))
    assert buffer.lookup("map", "cup", 4 * S)[1] == pytest.approx(at(50))


def test_a_cycle_is_an_error_and_ends(buffer: TransformBuffer) -> None:
    for second in range(6, 8):
        buffer.insert("hand", "map", second * S, at(1), "me")
    buffer.insert("x", "y", 6 * S, at(1), "me")

    with pytest.raises(LookupException, match="contains a loop"):
        buffer.lookup("base", "y", 0)


def test_clearing_keeps_static_transforms(buffer: TransformBuffer) -> None:
    buffer.clear()

    assert buffer.lookup("arm", "hand", 3 * S)[1] == at(0.5)
    with pytest.raises(ConnectivityException):
        buffer.lookup("map", "base", 0)
    assert buffer.as_string().startswith("Frame base exists with parent NO_PARENT.\n")


@pytest.mark.parametrize(("target", "source", "fixed", "expected"), [
    ("map", "map", "map", []), ("map", "hand", "map", ["hand", "arm", "base", "map"]),
    ("hand", "map", "map", ["map", "base", "arm", "hand"]),
    ("hand", "base", "map", ["base", "map", "base", "arm", "hand"]),
    ("cam", "hand", "cam", ["hand", "arm", "base", "cam"]),
    ("cam", "hand", "hand", ["hand", "arm", "base", "cam"]),
])  # fmt: skip
def test_the_path_through_the_tree(
    buffer: TransformBuffer, target: str, source: str, fixed: str, expected: list[str]
) -> None:
    buffer.insert("base", "cam", 0, at(1), "me", is_static=True)

    assert buffer.chain(target, 3 * S, source, 3 * S, fixed) == expected


def test_frames_are_listed_for_tools(buffer: TransformBuffer) -> None:
    yaml = buffer.as_yaml()
    assert yaml.startswith("base: \n  parent: 'map'\n  broadcaster: 'me'\n  rate: 1.250\n")
    assert '"arm" -> "hand"[label="Broadcaster: me\\nAverage rate: 10000.000 Hz' in buffer.as_dot()
    assert "( 1.000 sec old)" in buffer.as_dot(6.0)
    assert TransformBuffer().as_yaml() == "{}"


def test_an_infinite_translation_is_accepted_as_in_tf2(buffer: TransformBuffer) -> None:
    assert buffer.insert("map", "far", S, at(math.inf), "me") == []
    assert buffer.lookup("map", "far", S)[1][0] == math.inf
    assert buffer.insert("map", "turned", S, (0, 0, 0, math.inf, 0, 0, 1), "me") != []


def test_a_stamp_of_the_far_future_makes_later_ones_old_as_in_tf2(buffer: TransformBuffer) -> None:
    assert buffer.insert("map", "base", (2**32 - 1) * S, at(1), "me") == []
    (refusal,) = buffer.insert("map", "base", 6 * S, at(6), "me")
    assert refusal.startswith("TF_OLD_DATA ignoring data from the past")
    assert "for frame base (parent map) at time" in refusal
    buffer.clear()
    assert buffer.insert("map", "base", 6 * S, at(6), "me") == []


def test_frames_beyond_the_limit_are_refused(constants: Constants) -> None:
    constants(TRANSFORM_BYTES=100000)
    buffer = TransformBuffer()
    refusals = [buffer.insert("map", f"frame_{number}", S, at(1), "me") for number in range(200)]

    assert 50 < len(buffer.frame_names()) < 100
    assert refusals[0] == []
    (refusal,) = refusals[-1]
    assert refusal.startswith(
        "TF_NO_ROOM there are too many transforms for frame frame_199: the limit is 100000"
    )
    assert buffer.insert("map", "frame_0", 2 * S, at(1), "me") == []
    assert len(buffer.insert("map", "x" * 10**6, S, at(1), "me")[0]) < 500


def test_transforms_beyond_the_limit_replace_older_ones_of_their_frame(constants: Constants) -> None:
    constants(TRANSFORM_BYTES=100000)
    buffer = TransformBuffer()
    for number in range(10_000):
        assert buffer.insert("map", "base", S + number, at(number), "me") == []

    assert buffer.lookup("map", "base", S + 9_999)[1][0] == 9_999
    with pytest.raises(ExtrapolationException, match="into the past"):
        buffer.lookup("map", "base", S + 1)


def test_the_frames_in_the_error_of_a_cycle_are_bounded(buffer: TransformBuffer) -> None:
    for number in range(1_000):
        buffer.insert("map", f"{number}" * 20, S, at(1), "me")
    buffer.insert("b", "a", S, at(1), "me")
    buffer.insert("a", "b", S, at(1), "me")

    with pytest.raises(LookupException, match="contains a loop") as raised:
        buffer.lookup("a", "map", S)
    assert len(str(raised.value)) < 11_000


# Queries of the branched besides lookups: possible transforms, common times, chains.


@pytest.fixture
def branched() -> TransformBuffer:
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


def test_possible_transforms_have_no_error(branched: TransformBuffer) -> None:
    assert branched.can_transform("map", "camera", 0) is None
    assert branched.can_transform("camera", "map", 2 * S) is None
    assert branched.can_transform("nowhere", "nowhere", 0) is None
    assert branched.can_transform_full("camera", 3 * S, "right", S, "map") is None


@pytest.mark.parametrize(("target", "source", "time", "reason"), [
    ("map", "nowhere", 0, "source_frame nowhere does not exist"),
    ("here", "nowhere", 0, "target_frame here does not exist. canTransform: source_frame nowhere"),
    ("map", "island", 0, "not part of the same tree"),
    ("map", "camera", 9 * S, "extrapolation .* into the future"),
    ("camera", "right", 4 * S, "extrapolation .* into the future"),
    ("right", "camera", 4 * S, "extrapolation .* into the future"),
    ("island", "map", S, "extrapolation at time"),
])  # fmt: skip
def test_the_error_about_a_transform_names_the_frame_or_time(
    branched: TransformBuffer, target: str, source: str, time: int, reason: str
) -> None:
    assert re.search(reason, branched.can_transform(target, source, time) or "")


@pytest.mark.parametrize(("arguments", "reason"), [
    (("here", S, "nowhere", S, "map"), "target_frame here does not exist. canTransform: source_frame"),
    (("map", 2 * S, "camera", 2 * S, "island"), "same tree"),
    (("map", 9 * S, "camera", S, "odom"), "extrapolation"),
])  # fmt: skip
def test_the_error_about_a_transform_between_two_times(
    branched: TransformBuffer, arguments: tuple[str, int, str, int, str], reason: str
) -> None:
    assert reason in str(branched.can_transform_full(*arguments))


@pytest.mark.parametrize("name", ["", "/map"])
def test_an_invalid_frame_name_raises_even_in_queries(branched: TransformBuffer, name: str) -> None:
    for target, source in ((name, "map"), ("map", name)):
        with pytest.raises(InvalidArgumentException):
            branched.can_transform(target, source, 0)


@pytest.mark.parametrize(("target", "source", "time"), [
    ("map", "camera", 3 * S), ("camera", "map", 3 * S), ("camera", "right", 3 * S), ("right", "base", 5 * S),
    ("right", "right", 5 * S), ("map", "map", 0), ("map", "dock", 0), ("dock", "camera", 3 * S),
])  # fmt: skip
def test_the_common_time_is_the_oldest_of_the_newest_on_the_path(
    branched: TransformBuffer, target: str, source: str, time: int
) -> None:
    assert branched.latest_common_time(target, source) == time


def test_frames_of_two_trees_have_no_common_time(branched: TransformBuffer) -> None:
    with pytest.raises(TransformException, match="same tree"):
        branched.latest_common_time("map", "island")
    with pytest.raises(LookupException, match='"nowhere" passed to get_latest_common_time'):
        branched.latest_common_time("nowhere", "map")


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


def test_a_chain_names_its_frames_or_those_that_are_not_connected(branched: TransformBuffer) -> None:
    assert branched.chain("right", S, "camera", S, "base") == ["camera", "left", "base", "right"]
    with pytest.raises(LookupException):
        branched.chain("right", S, "nowhere", S, "map")
    with pytest.raises(ConnectivityException):
        branched.chain("island", 2 * S, "camera", 2 * S, "map")


def test_a_frame_in_itself_is_at_its_newest_time(branched: TransformBuffer) -> None:
    assert branched.lookup("right", "right", 0) == (5 * S, (0, 0, 0, 0, 0, 0, 1))
    assert branched.lookup("nowhere", "nowhere", 7) == (7, (0, 0, 0, 0, 0, 0, 1))


def test_the_leading_slash_of_tf_is_removed() -> None:
    branched = TransformBuffer()
    assert branched.insert("/map", "/base", S, at(1), "me") == []
    assert branched.frame_names() == ["base", "map"]


@pytest.mark.parametrize("yaw", [0.4, 3.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_exact_composition_gives_unit_quaternions(axis: int, yaw: float) -> None:
    half = [0.0, 0.0, 0.0]
    half[axis] = math.sin(yaw / 2)
    turn: Pose = (1.0, 2.0, 3.0, half[0], half[1], half[2], math.cos(yaw / 2))

    assert compose_via_matrices(turn, inverted(turn)) == pytest.approx((0, 0, 0, 0, 0, 0, 1))
    same = normalized(turn)
    assert same == pytest.approx(turn) or same[3:] == pytest.approx([-part for part in turn[3:]])
