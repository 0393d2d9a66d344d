"""Remembered paths between frames: lookups answer as if every path were searched for."""

import math
import random
from collections.abc import Callable

import pytest

from pipros_libraries.transforms.buffer import DEFAULT_LENGTH, TransformBuffer
from pipros_libraries.transforms.errors import ExtrapolationException, TransformException
from pipros_libraries.transforms.history import MovingFrame, StaticFrame
from pipros_libraries.transforms.pose import IDENTITY, Pose
from pipros_libraries.transforms.tree import Frames, find_path
from pipros_libraries.transforms.twist import interval_around, twist
from pipros_libraries.transforms.waiter import TransformWaiter
from tests.support.constants import Constants

S = 1_000_000_000


def at(x: float) -> Pose:
    return (x, *IDENTITY[1:])


@pytest.fixture
def buffer() -> TransformBuffer:
    """Frames map → odom → base and map → dock at 1 s and 2 s, whose paths have been looked up."""
    made = TransformBuffer()
    for second in (1, 2):
        made.insert("map", "odom", second * S, at(10), "me")
        made.insert("odom", "base", second * S, at(second), "me")
        made.insert("map", "dock", second * S, at(100), "me")
    assert made.lookup("map", "base", 0) == (2 * S, at(12))
    assert made.lookup("dock", "base", 0) == (2 * S, at(-88))
    assert made.can_transform("dock", "base", S) is None
    return made


def test_a_path_whose_old_parent_has_expired_is_that_of_the_new_one(buffer: TransformBuffer) -> None:
    buffer.insert("dock", "base", 3 * S, at(7), "me")
    for second in (20, 21):
        buffer.insert("dock", "base", second * S, at(8), "me")
        buffer.insert("map", "dock", second * S, at(100), "me")

    assert buffer.lookup("map", "base", 0) == (21 * S, at(108))
    with pytest.raises(ExtrapolationException, match="into the past"):
        buffer.lookup("map", "base", 2 * S)


def test_a_late_pose_replaces_results_that_were_kept(buffer: TransformBuffer) -> None:
    assert [buffer.lookup("map", "base", 3 * S // 2)[1] for _ in range(3)] == [at(11.5)] * 3
    buffer.insert("odom", "base", 5 * S // 4, at(4), "me")
    assert buffer.lookup("map", "base", 3 * S // 2)[1] == pytest.approx(at(10 + 4 - 2 / 3))


def test_a_static_frame_moves_to_its_new_parent() -> None:
    buffer = TransformBuffer()
    buffer.insert("left", "camera", 0, at(1), "me", is_static=True)
    buffer.insert("base", "left", 0, at(10), "me", is_static=True)
    buffer.insert("base", "right", 0, at(20), "me", is_static=True)
    assert buffer.lookup("base", "camera", 5 * S) == (5 * S, at(11))

    buffer.insert("right", "camera", 0, at(2), "me", is_static=True)

    assert buffer.lookup("base", "camera", 5 * S) == (5 * S, at(22))


def test_static_frames_below_a_moving_one_are_connected_at_any_time() -> None:
    buffer = TransformBuffer()
    for stamp in (0, 5 * S):
        buffer.insert("map", "base", stamp, at(stamp), "me")
    buffer.insert("base", "left", 0, at(1), "me", is_static=True)
    buffer.insert("base", "right", 0, at(-1), "me", is_static=True)

    assert buffer.lookup("right", "left", 0) == (0, at(2))
    assert buffer.lookup("right", "left", 2 * S) == (2 * S, at(2))
    assert buffer.can_transform("right", "left", 6 * S) is None


def test_unavailable_times_have_the_same_reason_as_before(buffer: TransformBuffer) -> None:
    reason = (
        "Lookup would require extrapolation 1.000000000s into the future.  Requested time 3.000000000 but "
        "the latest data is at time 2.000000000, when looking up transform from frame [base] to frame [dock]"
    )

    assert buffer.can_transform("dock", "base", 3 * S) == reason
    with pytest.raises(ExtrapolationException) as raised:
        buffer.lookup("dock", "base", 3 * S)
    assert str(raised.value) == reason


def test_lookups_are_unaffected_by_the_limit_of_remembered_paths(constants: Constants) -> None:
    constants(TRANSFORM_CHAINS_BYTES=3000)
    buffer = TransformBuffer()
    for number in range(20):
        buffer.insert(f"f{number}", f"f{number + 1}", S, at(1), "me")

    for _ in range(2):
        assert [buffer.lookup("f0", f"f{n}", 0)[1][0] for n in range(1, 21)] == list(range(1, 21))


@pytest.mark.parametrize("seed", range(20))
def test_lookups_are_equal_to_searches_after_any_change(seed: int) -> None:
    dice = random.Random(seed)  # noqa: S311 # not for secrets
    names = [f"f{number}" for number in range(8)]
    buffer = TransformBuffer()
    frames: Frames = {}

    def change() -> None:
        # A frame's parents have smaller numbers, except for rare loops.
        child = dice.randrange(1, 8)
        parent = (child + dice.choice((-1, -1, -1, -2, -3, 1 if dice.random() < 0.05 else -1))) % 8
        stamp = dice.choice((0, S * dice.randrange(1, 30)))
        pose = (dice.random(), dice.random(), dice.random(), *dice.choice((IDENTITY[3:], (0.6, 0, 0, 0.8))))
        is_static = child in (3, 5)
        buffer.insert(names[parent], names[child], stamp, pose, "me", is_static)
        for name in (names[child], names[parent]):
            frames.setdefault(name, None)
        history = frames[names[child]] or (StaticFrame() if is_static else MovingFrame(DEFAULT_LENGTH))
        history.insert(stamp, names[parent], pose)
        frames[names[child]] = history

    def compare(target: str, source: str, time: int) -> None:
        try:
            path = find_path(frames, target, source, time)
        except TransformException as error:
            expected: TransformException | tuple[int, Pose] = error
        else:
            expected = path.time, path.pose()
        if isinstance(expected, tuple):
            assert buffer.can_transform(target, source, time) is None
            assert buffer.lookup(target, source, time) == expected
        else:
            assert buffer.can_transform(target, source, time) == str(expected)
            with pytest.raises(type(expected)) as raised:
                buffer.lookup(target, source, time)
            assert str(raised.value) == str(expected)

    asked = [0]
    for _ in range(60):
        for _ in range(dice.randrange(1, 6)):
            change()
        if dice.random() < 0.03:
            buffer.clear()
            for history in frames.values():
                if history is not None:
                    history.clear()
        for _ in range(10):
            # Some times are asked for again, before and after changes, whose results are cached.
            asked.append(dice.choice((0, S * dice.randrange(30), dice.randrange(30 * S), *asked[-3:])))
            compare(*dice.sample(list(frames), 2), asked[-1])


# Waiting for transforms, with a clock that the test sets.


class SetClock:
    """A simulated clock that returns the given times, one at each reading, and then the last of them."""

    is_simulated = True

    def __init__(self, *times: int) -> None:
        self._times = list(times)

    def now_ns(self) -> int:
        return self._times.pop(0) if len(self._times) > 1 else self._times[0]


Ask = Callable[[], tuple[int, str]]


def waited(clock: SetClock, ask: Ask, check: Callable[[], object]) -> tuple[int, str]:
    return TransformWaiter().wait(ask, 10 * S, lambda: clock, check)


@pytest.mark.parametrize("end", [110 * S, 96 * S])
def test_a_wait_ends_at_its_time_or_when_the_clock_has_jumped_back(end: int) -> None:
    checks: list[int] = []

    answer = waited(SetClock(100 * S, 98 * S, end), lambda: (0, "unknown"), lambda: checks.append(1))

    assert (answer, len(checks)) == ((0, "unknown"), 1)


def test_a_check_that_raises_ends_the_wait() -> None:
    def check() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        waited(SetClock(100 * S), lambda: (0, "unknown"), check)


# Velocities of frames, from two of their poses.


QUARTER = math.sqrt(0.5)


def turned(x: float, yaw: float = 0.0) -> Pose:
    return (x, 0.0, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


@pytest.mark.parametrize(("time", "latest", "expected"), [
    (10 * S, 20 * S, (9 * S, 11 * S)), (10 * S, 10 * S, (8 * S, 10 * S)), (S, S, (100_000, S))
])  # fmt: skip
def test_the_interval_ends_with_the_buffer_and_begins_after_zero(
    time: int, latest: int, expected: tuple[int, int]
) -> None:
    assert interval_around(time, latest, 2 * S) == expected


def test_a_frame_that_moves_straight_has_a_linear_velocity_only() -> None:
    linear, angular = twist(turned(1.0), turned(2.0), S // 2, IDENTITY, IDENTITY)

    assert (linear, angular) == ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("turn", [1.0, -1.0, 3.0])
def test_a_frame_that_turns_has_an_angular_velocity_of_either_sign(turn: float) -> None:
    _, angular = twist(turned(0.0, 0.5), turned(0.0, 0.5 + turn), 2 * S, IDENTITY, IDENTITY)

    assert angular == pytest.approx((0.0, 0.0, turn / 2))


def test_velocities_are_turned_into_the_reference_frame() -> None:
    tracked = (0.0, 0.0, 0.0, 0.0, 0.0, QUARTER, QUARTER)

    linear, _ = twist(turned(0.0), turned(1.0), S, tracked, IDENTITY)

    assert linear == pytest.approx((0.0, 1.0, 0.0))


def test_the_reference_point_shifts_the_velocity_as_in_noetic() -> None:
    reference_point = (0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0)

    linear, _ = twist(turned(0.0), turned(0.0, 0.5), S, turned(2.0), reference_point)

    assert linear == pytest.approx((1.5, 1.5 - 2.0 * 0.5, 1.5))  # 1.5 is the scalar product of (0, 0, 0.5)
