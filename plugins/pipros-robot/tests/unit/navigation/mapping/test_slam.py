"""Maps of the apartment, and the parts of the mapper against plain loops."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.mapping.hit_maps import HitMaps
from pipros_robot.navigation.mapping.matching import ScanMatcher
from pipros_robot.navigation.mapping.settings import MappingSettings, read_settings
from pipros_robot.navigation.mapping.slam import GridSlam
from pipros_robot.navigation.mapping.survey import Survey, TrajectoryStep
from pipros_simulation.robots.drive import Pose
from tests.support.drives import agreement, drive

BEGIN = Pose(2.9, 1.0, 0.0)
SETTINGS = replace(MappingSettings(), xmin=-8.0, ymin=-8.0, xmax=12.0, ymax=12.0, particles=10).with_ranges(
    10.0
)
ANGLES = np.linspace(-2.0, 2.0, 9)


def test_the_map_agrees_with_the_apartment() -> None:
    angles = math.tau / 180 * np.arange(180)
    settings = replace(SETTINGS, linearUpdate=0.3, angularUpdate=0.3)
    slam = GridSlam(settings, angles, (0.0, 0.0, 0.0), np.random.default_rng(1))
    survey = Survey(settings, angles)
    for moment in list(drive(start=BEGIN, noise=0.02))[::3]:
        odometry = moment.odometry.x, moment.odometry.y, moment.odometry.yaw
        if slam.scan(odometry, moment.ranges, moment.time_s):
            survey.follow(slam.steps[slam.best])

    found = agreement(survey.values(), survey.origin, BEGIN)
    x, y, _ = slam.poses[slam.best]
    assert found.free_iou > 0.93
    assert found.walls_near > 0.92
    assert found.walls_seen > 0.92
    assert math.hypot(x + BEGIN.x - moment.truth.x, y + BEGIN.y - moment.truth.y) < 0.15


def test_without_echoes_all_particles_follow_the_odometry() -> None:
    """Nothing can repair a wrong motion here, as scan matching does in the apartment."""
    settings = replace(SETTINGS, srr=0.0, srt=0.0, str=0.0, stt=0.0, linearUpdate=0.3)
    angles = 0.3 * np.arange(40)  # a spiral, driven forwards and sideways
    path = np.stack((angles * np.cos(angles), 1.0 - angles * np.sin(angles), 2.0 * angles), axis=1)
    slam = GridSlam(settings, ANGLES, (0.0, 1.0, 0.0), np.random.default_rng(1))
    for index, odometry in enumerate(path.tolist()):
        slam.scan(tuple(odometry), np.full(9, math.inf), 0.1 * index)

        apart = slam.poses - odometry
        apart[:, 2] = np.remainder(apart[:, 2] + math.pi, math.tau) - math.pi
        assert np.abs(apart).max() < 1e-6


def test_the_particles_spread_as_the_noise_of_the_motion_says() -> None:
    """Forward by 2 m and to the left by 1 m, or a turn by 1 rad."""
    settings = replace(SETTINGS, particles=4000, srr=0.1, srt=0.02, str=0.05, stt=0.03)
    moved, turned = (
        GridSlam(settings, ANGLES, (0.0, 0.0, 0.0), np.random.default_rng(seed)) for seed in (1, 2)
    )
    moved.scan((2.0, 1.0, 0.0), np.full(9, math.inf), 0.0)
    turned.scan((0.0, 0.0, 1.0), np.full(9, math.inf), 0.0)

    assert moved.poses.mean(axis=0) == pytest.approx((2.0, 1.0, 0.0), abs=0.02)
    deviations = (0.1 * 2.0 + 0.03 * 1.0, 0.1 * 1.0 + 0.03 * 2.0, 0.02 * math.hypot(2.0, 1.0))
    assert moved.poses.std(axis=0) == pytest.approx(deviations, rel=0.05)
    assert turned.poses.mean(axis=0) == pytest.approx((0.0, 0.0, 1.0), abs=0.01)
    assert turned.poses.std(axis=0) == pytest.approx((0.05, 0.05, 0.03), rel=0.05)


def test_scans_are_processed_after_a_motion_or_some_time() -> None:
    settings = replace(SETTINGS, linearUpdate=1.0, angularUpdate=0.5, temporalUpdate=3.0)
    slam = GridSlam(settings, ANGLES, (0.0, 0.0, 0.0), np.random.default_rng(1))
    ranges = np.full(9, 3.0)

    def scan(x: float, yaw: float, time_s: float) -> bool:
        return slam.scan((x, 0.0, yaw), ranges, time_s)

    assert scan(0.0, 0.0, 0.0)
    assert not scan(0.6, 0.0, 1.0)
    assert scan(0.1, 0.0, 1.1)  # distances are added up
    assert not scan(0.1, 0.4, 1.2)
    assert scan(0.1, 0.5, 1.3)
    assert not scan(0.1, 0.5, 4.3)
    assert scan(0.1, 0.5, 4.4)


def test_the_match_finds_the_pose_and_scores_as_a_plain_loop() -> None:
    rng = np.random.default_rng(2)
    angles = np.linspace(-3.1, 3.1, 120)
    cosine, sine = np.cos(angles), np.sin(angles)
    walls = np.minimum(2.0 / np.maximum(abs(cosine), 1e-9), 1.5 / np.maximum(abs(sine), 1e-9))  # of a room
    maps, matcher = HitMaps(3, SETTINGS.delta), ScanMatcher(SETTINGS, angles)
    for _ in range(5):
        seen = np.tile(walls + rng.normal(0.0, 0.005, walls.shape), (3, 1))
        maps.add(seen * cosine, seen * sine)
    shifted = np.array([(0.1, -0.07, 0.05), (-0.12, 0.03, -0.06), (0.0, 0.0, 0.0)])

    poses, logs = matcher.match(maps, shifted, walls)

    assert poses == pytest.approx(np.zeros((3, 3)), abs=0.02)
    window = maps.window(np.arange(3), np.array((-3.0, -3.0)), np.array((3.0, 3.0)))
    hits = {
        (row + window.row, column + window.column): (window.x[0, row, column], window.y[0, row, column])
        for row, column in np.argwhere(window.is_hit[0])
    }
    x, y, yaw = poses[0]
    total = 0.0
    for reach, angle in zip(walls, angles, strict=True):
        along, across = math.cos(yaw + angle), math.sin(yaw + angle)
        end_x, end_y = x + reach * along, y + reach * across
        row, column = math.floor(end_y / 0.05 + 0.5), math.floor(end_x / 0.05 + 0.5)
        before = round(-math.sqrt(2) * across), round(-math.sqrt(2) * along)
        squares = [
            (mean[0] - end_x) ** 2 + (mean[1] - end_y) ** 2
            for (r, c), mean in hits.items()
            if abs(r - row) <= 1 and abs(c - column) <= 1 and (r + before[0], c + before[1]) not in hits
        ]
        total += (-min(squares) if squares else -0.5) / SETTINGS.lsigma
    assert logs[0] == pytest.approx(total)


def test_beams_between_earlier_ones_do_not_turn_a_scan() -> None:
    angles = np.linspace(-math.pi, math.pi, 180, endpoint=False)
    maps, matcher = HitMaps(1, SETTINGS.delta), ScanMatcher(SETTINGS, angles)

    def seen(yaw: float) -> Any:
        """Return the ranges in a room of 6 x 5 m, from its centre in this direction."""
        cosine, sine = abs(np.cos(angles + yaw)), abs(np.sin(angles + yaw))
        return np.minimum(3.0 / np.maximum(cosine, 1e-9), 2.5 / np.maximum(sine, 1e-9))

    maps.add((seen(0.0) * np.cos(angles))[None], (seen(0.0) * np.sin(angles))[None])
    turn = 20.4 * math.tau / 180

    poses, _ = matcher.match(maps, np.array([(0.0, 0.0, turn)]), seen(turn))

    assert poses[0] == pytest.approx((0.0, 0.0, turn), abs=0.002)


def test_particles_share_blocks_until_they_write() -> None:
    maps = HitMaps(4, 0.05)
    maps.add(np.full((4, 1), 1.0), np.full((4, 1), 2.0))
    maps.resample(np.array([2, 2, 2, 0]))
    maps.add(np.array([[1.02], [1.02], [40.0], [1.0]]), np.array([[2.02], [2.02], [40.0], [2.0]]))

    window = maps.window(np.arange(4), np.array((0.5, 1.5)), np.array((41.0, 41.0)))

    row, column = round(2.0 / 0.05) - window.row, round(1.0 / 0.05) - window.column
    assert window.x[:, row, column] == pytest.approx([1.01, 1.01, 1.0, 1.0])
    assert window.is_hit.sum(axis=(1, 2)).tolist() == [1, 1, 2, 1]
    assert window.y[2, 800 - window.row, 800 - window.column] == 40.0


def test_a_survey_counts_the_cells_of_beams_and_changes_with_the_trajectory() -> None:
    settings = replace(SETTINGS, xmin=-1.6, ymin=-1.6, xmax=1.6, ymax=1.6, maxUrange=1.0, maxRange=2.0)
    ranges = np.array([0.5, 1.5, 3.0])  # a hit, a beam that is cut, one that is ignored
    angles = np.array([0.0, math.pi / 2, math.pi])
    first = TrajectoryStep((0.0, 0.0, 0.0), ranges, None)
    one, other = (
        TrajectoryStep((0.0, 0.2, 0.0), ranges, first),
        TrajectoryStep((0.0, -0.2, 0.0), ranges, first),
    )
    survey = Survey(settings, angles)
    survey.follow(one)
    survey.follow(other)

    again = Survey(settings, angles)
    again.follow(other)
    values = survey.values()
    assert np.array_equal(values, again.values())
    assert (values.shape, survey.origin) == ((64, 64), (-1.6, -1.6))
    assert values[32, 32:42].tolist() == [0] * 10
    assert values[32, 42] == values[28, 42] == 100
    assert values[36, 42] == -1  # of the first trajectory only
    assert values[32:52, 32].tolist() == [0] * 20
    assert values[52:, 32].tolist() == [-1] * 12
    assert values[32, :32].tolist() == [-1] * 32


def test_a_survey_grows_when_scans_leave_it_but_not_without_limit() -> None:
    settings = replace(SETTINGS, xmin=-1.6, ymin=-1.6, xmax=1.6, ymax=1.6)
    survey = Survey(settings, np.zeros(1), 64 * 320)
    survey.follow(TrajectoryStep((0.0, 0.0, 0.0), np.array([3.0]), None))
    values = survey.values()
    assert values.shape == (64, 10 * 32)  # 14.6 m from -1.6 m to 3 m and 10 m more, in multiples of 32 cells
    assert values[32, 32 + 60] == 100

    survey.follow(TrajectoryStep((20.0, 0.0, 0.0), np.array([3.0]), None))
    assert survey.values().shape == values.shape


def test_invalid_parameters_are_refused_with_their_names() -> None:
    assert read_settings(PrivateParameters({"tf_delay": 0.3, "particles": 80.0})).particles == 80
    slashed = read_settings(PrivateParameters({"base_frame": "/base_footprint", "odom_frame": "/odom"}))
    assert (slashed.base_frame, slashed.odom_frame) == ("base_footprint", "odom")
    assert read_settings(PrivateParameters({"transform_publish_period": 0.2})).tf_delay == 0.2
    with pytest.raises(InvalidParameter, match="~particles must be > 0 and finite, got 0"):
        read_settings(PrivateParameters({"particles": 0}))
    with pytest.raises(InvalidParameter, match="~xmin must be at least a cell"):
        read_settings(PrivateParameters({"xmin": 3.0, "xmax": 3.0}))
