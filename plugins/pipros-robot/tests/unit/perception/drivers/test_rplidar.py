"""The formats of RPLIDARs, decoded by the driver and by pyrplidar."""

import itertools
import random
import struct
from collections.abc import Callable, Iterable, Sequence
from math import inf, pi, radians
from typing import Any

import pyrplidar_protocol as independent
import pytest

from pipros_robot.perception.drivers.rplidar.samples import Point, decoder_of
from pipros_robot.perception.drivers.rplidar.turns import TurnCollector, cells_per_degree, sweep_of
from tests.support import simulated_rplidar as device

SAMPLE_US = 250.0


def numbers(seed: int) -> random.Random:
    return random.Random(seed)  # noqa: S311


def decoded(answer: int, data: bytes, sizes: Iterable[int] = ()) -> tuple[list[Point], list[int]]:
    """Return all points, and the indices of those that begin a turn, of data that arrives in pieces."""
    decoder = decoder_of(answer, SAMPLE_US)
    points: list[Point] = []
    starts: list[int] = []
    at = 0
    for size in [*sizes, len(data)]:
        for is_start, segment in decoder.feed(data[at : at + size]):
            starts += [len(points)] if is_start else []
            points += segment
        at += size
    return points, starts


def agrees(points: Sequence[Point], starts: Sequence[int], nodes: Sequence[Any]) -> None:
    """Check that points are those of pyrplidar, whose angles are rounded to 1/64 degree and more."""
    assert len(points) == len(nodes) > 0
    assert starts == [at for at, node in enumerate(nodes) if node.start_flag == 1]
    for point, node in zip(points, nodes, strict=True):
        assert point.distance_mm == node.get_distance()
        assert point.quality == node.quality >> 2
        assert abs((point.angle - node.get_angle() + 180) % 360 - 180) < 0.04


def capsules_of_pyrplidar(kind: Any, capsules: Sequence[bytes]) -> list[Any]:
    parsed = [kind(each) for each in capsules]
    return [
        node for before, after in itertools.pairwise(parsed) for node in kind._parse_capsule(before, after)
    ]


def test_standard_scans() -> None:
    rng = numbers(1)
    raw = [
        device.node(
            rng.uniform(0, 359.9), rng.choice([0, rng.uniform(1, 16000)]), not at % 7, rng.randrange(64)
        )
        for at in range(200)
    ]
    points, starts = decoded(0x81, b"".join(raw), [1, 2, 3, 4, 5, 6, 7])
    expected = [independent.PyRPlidarMeasurement(each) for each in raw]
    assert points == [(each.angle, each.distance, each.quality) for each in expected]
    assert starts == [at for at, each in enumerate(expected) if each.start_flag]


def express_capsules(rng: random.Random) -> list[bytes]:
    return [
        device.express(
            at * 11.3 % 360, [(rng.choice([0, rng.randrange(16384)]), rng.randrange(64)) for _ in range(32)]
        )
        for at in range(100)
    ]


def ultra_capsules(rng: random.Random) -> list[bytes]:
    def word() -> tuple[int, int, int]:
        # pyrplidar wraps distances below 0
        return rng.choice([0, rng.randrange(600, 4096)]), rng.choice([-512, 511, 0, 90]), rng.randrange(511)

    return [device.ultra(at * 34.3 % 360, [word() for _ in range(32)]) for at in range(100)]


FORMATS: dict[int, tuple[Callable[[random.Random], list[bytes]], Any]] = {
    0x82: (express_capsules, independent.PyRPlidarScanCapsule),
    0x84: (ultra_capsules, independent.PyRPlidarScanUltraCapsule),
}


@pytest.mark.parametrize("answer", FORMATS)
def test_capsules(answer: int) -> None:
    rng = numbers(answer)
    make, kind = FORMATS[answer]
    capsules = make(rng)
    points, starts = decoded(answer, b"".join(capsules), [rng.randrange(300) for _ in range(30)])
    agrees(points, starts, capsules_of_pyrplidar(kind, capsules))


def test_dense_capsules_whose_bytes_pyrplidar_swaps() -> None:
    rng = numbers(85)
    scans = [[rng.choice([0, rng.randrange(40000)]) for _ in range(40)] for _ in range(100)]
    points, starts = decoded(
        0x85, b"".join(device.dense(at * 9.7 % 360, each) for at, each in enumerate(scans))
    )
    swapped = [struct.unpack(">40H", struct.pack("<40H", *each)) for each in scans]
    theirs = [device.dense(at * 9.7 % 360, each) for at, each in enumerate(swapped)]
    agrees(points, starts, capsules_of_pyrplidar(independent.PyRPlidarScanDenseCapsule, theirs))


def test_ultra_dense_capsules() -> None:
    """Computed by hand: pyrplidar lacks them. tests.interop compares them with the vendor's library."""
    values = [
        0b11111111 << 12 | 500 << 2, 0b1000000 << 13 | 10 << 2 | 1, 3 << 14 | 7 << 2 | 2, 1 << 15 | 2 << 2 | 3
    ]  # fmt: skip
    values += [200 << 12 | 50 << 2, 200 << 12 | 51 << 2, 0, *[0] * 57]
    data = device.ultra_dense(0.0, values) + device.ultra_dense(64.0, values)
    points, starts = decoded(0x86, data)
    assert not starts
    distances = [1000, 10 * 3 + 2046, 7 * 4 + 8187, 2 * 5 + 24567, 100, 101]
    assert [each.distance_mm for each in points[:7]] == [*distances, 0]
    assert [each.quality for each in points[:4]] == [63, 32, 3, 2]
    assert [each.angle for each in points] == [*range(64)]


def test_a_turn_begins_once_whatever_the_angles() -> None:
    rng, angle, capsules = numbers(3), 0, []
    for _ in range(2000):
        capsules.append(device.dense(angle / 64 % 360, [1000] * 40))
        step = rng.choice([0, 1, 192, 575, 1280])
        angle += step
    points, starts = decoded(0x85, b"".join(capsules))
    assert len(points) == 40 * (len(capsules) - 1)
    assert len(starts) == (angle - step) // (360 * 64) > 30


@pytest.mark.parametrize("answer", [0x82, 0x84, 0x85, 0x86])
def test_damage_costs_the_capsules_around_it_only(answer: int) -> None:
    make = {
        0x82: lambda at: device.express(at, [(1000, 0)] * 32),
        0x84: lambda at: device.ultra(at, [(500, 0, 0)] * 32),
        0x85: lambda at: device.dense(at, [1000] * 40),
        0x86: lambda at: device.ultra_dense(at, [400 << 2] * 64),
    }[answer]
    raw = [make(10.0 * at % 360) for at in range(72)]
    count = device.POINTS[answer]
    assert len(decoded(answer, b"".join(raw))[0]) == 71 * count
    damaged = list(raw)
    damaged[20] = damaged[20][:50] + bytes([damaged[20][50] ^ 1]) + damaged[20][51:]
    points, starts = decoded(answer, b"".join(damaged))
    assert len(points) == 69 * count
    assert len(starts) == 1
    # the capsules around the beginning of a turn are lost: it begins with the next one
    damaged[35] = b"\xa5\x5a" + bytes(200)
    points, starts = decoded(answer, b"".join(damaged))
    assert len(points) == 67 * count
    assert len(starts) == 1
    assert abs((points[starts[0]].angle + 180) % 360 - 180) < 10


def test_capsules_with_a_gap_or_after_a_restart_are_not_joined() -> None:
    far = device.dense(0.0, [1000] * 40) + device.dense(200.0, [1000] * 40)
    assert decoded(0x85, far)[0] == []
    new = device.dense(0.0, [1000] * 40) + device.dense(9.0, [1000] * 40, is_new=True)
    assert decoded(0x85, new)[0] == []
    assert len(decoded(0x85, new + device.dense(18.0, [1000] * 40))[0]) == 40


def test_nodes_are_found_again_after_garbage() -> None:
    good = b"".join(device.node(at, 1000, not at) for at in range(100))
    points, starts = decoded(0x81, good[2:] + b"\0\0" + good)
    assert [each.angle for each in points[-100:]] == [*range(100)]
    assert len(starts) == 1


def test_turns_without_a_beginning_are_bounded() -> None:
    turns, point = TurnCollector(), Point(1.0, 1000, 47)
    assert turns.add((False, [point] * 100)) is None
    assert turns.add((True, [point])) is None
    for _ in range(100):
        assert turns.add((False, [point] * 100)) is None
    assert turns.add((True, [point])) is None, "8192 points are too many for a turn"
    assert turns.add((True, [])) == [point]


# Scans of turns, computed by hand.


TURN = [Point(90.0, 1000, 10), Point(0.0, 0, 0), Point(270.0, 3000, 30), Point(0.0, 0, 0)]
"""Valid points at 90 and 270 degrees; the others would be at 180 and 360."""


def test_a_scan_ends_with_the_first_and_last_valid_point() -> None:
    sweep = sweep_of(TURN, None, is_inverted=False)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(-pi / 2), pytest.approx(pi / 2))
    assert (sweep.ranges, sweep.intensities) == ([3.0, inf, 1.0], [30, 0, 10])
    inverted = sweep_of(TURN, None, is_inverted=True)
    assert (inverted.angle_min, inverted.ranges) == (sweep.angle_min, [1.0, inf, 3.0])


def test_points_fill_the_cells_up_to_the_next_degree() -> None:
    sweep = sweep_of([*TURN, Point(359.9, 5000, 1)], 1.5, is_inverted=True)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(-pi), pytest.approx(pi))
    assert len(sweep.ranges) == 540
    filled = {at: each for at, each in enumerate(sweep.ranges) if each < inf}
    assert filled == {135: 1.0, 136: 1.0, 405: 3.0, 406: 3.0, 539: 5.0}


def test_a_turn_without_valid_points_has_all_angles() -> None:
    sweep = sweep_of([Point(1.0, 0, 0)] * 3, 1.5, is_inverted=False)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(pi - radians(359)), pytest.approx(pi))
    assert (sweep.ranges, sweep.intensities) == ([inf] * 3, [0] * 3)


def test_the_number_of_cells_follows_the_rate() -> None:
    assert cells_per_degree(125.0, 10.0) == 800 / 360 + 1
    assert cells_per_degree(1e9, 10.0) == 1.0
