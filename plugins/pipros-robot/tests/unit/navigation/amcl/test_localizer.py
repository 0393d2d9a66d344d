"""The particle filter, and localisation on drives through the apartment."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.amcl.grid import GridMap
from pipros_robot.navigation.amcl.localizer import Localizer
from pipros_robot.navigation.amcl.particles import ParticleFilter, kld_limits
from pipros_robot.navigation.amcl.sensors import Beams, read_beams
from pipros_robot.navigation.amcl.settings import AmclSettings, Belief, checked, read_settings
from tests.support.drives import ROUTE, START, Moment, apartment, drive

ROBOT = Belief(START.x, START.y, START.yaw, 0.04, 0.04, 0.02)
SETTINGS = replace(AmclSettings(), min_particles=500, max_particles=2000, laser_max_beams=60)


def sampling(
    least: int, most: int, error: float = 0.01, slow: float = 0.0, fast: float = 0.0
) -> AmclSettings:
    return AmclSettings(
        min_particles=least, max_particles=most, kld_err=error, recovery_alpha_slow=slow,
        recovery_alpha_fast=fast,
    )  # fmt: skip


@pytest.fixture(scope="module")
def grid() -> GridMap:
    return GridMap(np.where(apartment(), 100, 0).astype(np.int8), 0.05, (0.0, 0.0))


@pytest.fixture(scope="module")
def moments() -> list[Moment]:
    return list(drive(route=ROUTE[:12]))[::2]


def beams_of(moment: Moment) -> Beams:
    count = len(moment.ranges)
    return read_beams(moment.ranges, math.tau / count * np.arange(count), (0.0, 0.0), 0.12, 10.0)


def errors_of(localizer: Localizer, moments: list[Moment]) -> list[tuple[float, float]]:
    """Drive; return the distances to the true pose and the angles of each estimate."""
    found = []
    for moment in moments:
        odometry = moment.odometry.x, moment.odometry.y, moment.odometry.yaw
        outcome = localizer.scan("laser", odometry, beams_of(moment))
        if outcome.estimate is not None:
            x, y, yaw = outcome.estimate.pose
            turn = abs(math.remainder(yaw - moment.truth.yaw, math.tau))
            found.append((math.hypot(x - moment.truth.x, y - moment.truth.y), turn))
    return found


@pytest.mark.parametrize(("k", "error", "least", "most", "wanted"), [
    (1, 0.01, 100, 5000, 5000), (2, 0.01, 100, 5000, 100), (5, 0.01, 100, 5000, 327),
    (10, 0.01, 100, 5000, 651), (50, 0.01, 100, 5000, 2936), (100, 0.01, 100, 5000, 5000),
    (10, 0.02, 500, 3000, 500), (50, 0.02, 500, 3000, 1468), (100, 0.02, 500, 3000, 2822),
])  # fmt: skip
def test_the_number_of_particles_follows_from_the_bins(
    k: int, error: float, least: int, most: int, wanted: int
) -> None:
    assert kld_limits(np.array([k]), sampling(least, most, error)) == [wanted]


def test_resampling_follows_the_weights_and_stops_at_the_limit() -> None:
    particles = ParticleFilter(sampling(400, 5000), np.random.default_rng(1))
    particles.spread(np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]))
    particles.weigh(np.array([1.0, 3.0, 0.0]))

    particles.resample(lambda count, rng: rng.random((count, 3)))

    assert len(particles.poses) == 401  # two bins need 100 particles, so the minimum counts
    assert np.mean(particles.poses[:, 0] == 1.0) == pytest.approx(0.75, abs=0.08)
    assert particles.weights.sum() == pytest.approx(1.0)


def test_the_estimate_is_the_heaviest_cluster_and_the_covariance_that_of_all() -> None:
    particles = ParticleFilter(sampling(1, 9), np.random.default_rng(1))
    particles.spread(np.array([(0.2, 0.0, 3.1), (0.7, 0.0, 3.2), (5.0, 0.0, 0.0)]))
    particles.weigh(np.array([1.0, 1.0, 1.5]))

    (weight, pose), covariance = particles.heaviest_cluster(), particles.covariance()

    assert weight == pytest.approx(2.0 / 3.5)
    assert pose == pytest.approx((0.45, 0.0, math.remainder(3.15, math.tau)))
    x = particles.poses[:, 0]
    mean = particles.weights @ x
    assert covariance[0, 0] == pytest.approx(particles.weights @ (x - mean) ** 2)
    length = abs(particles.weights @ np.exp(1j * particles.poses[:, 2]))
    assert covariance[2, 2] == pytest.approx(-2 * math.log(length))


@pytest.mark.parametrize(
    ("laser", "odometry"),
    [("likelihood_field", "diff-corrected"), ("likelihood_field_prob", "diff"), ("beam", "diff")],
)
def test_the_pose_stays_near_the_truth(
    grid: GridMap, moments: list[Moment], laser: str, odometry: str
) -> None:
    settings = replace(SETTINGS, laser_model_type=laser, odom_model_type=odometry)
    localizer = Localizer(grid, settings, ROBOT, np.random.default_rng(3))

    errors = np.array(errors_of(localizer, moments))

    assert len(errors) > 30
    distance, turn = np.percentile(errors, 95, axis=0)
    assert distance < 0.1
    assert turn < math.radians(3.0)


def test_a_robot_is_found_anywhere_on_the_map(grid: GridMap, moments: list[Moment]) -> None:
    settings = replace(SETTINGS, max_particles=8000, laser_model_type="likelihood_field_prob")
    localizer = Localizer(grid, settings, Belief(), np.random.default_rng(4))
    localizer.start_anywhere()

    spread = localizer.particles.covariance()

    errors = errors_of(localizer, moments)

    assert spread[0, 0] > 4.0
    assert errors[-1][0] < 0.15


def test_random_particles_appear_as_measurements_get_worse() -> None:
    """After the averages w_slow and w_fast, a share of 1 - w_fast / w_slow of the particles is random."""
    particles = ParticleFilter(sampling(20_000, 20_000, slow=0.01, fast=0.5), np.random.default_rng(1))
    particles.spread(np.zeros((1000, 3)))
    for factor in (1.0, 0.2):
        particles.weigh(np.full(1000, factor))

    particles.resample(lambda count, _: np.full((count, 3), 7.0))

    share = 1.0 - 0.6 / 0.992
    assert np.mean(particles.poses[:, 0] == 7.0) == pytest.approx(share, abs=0.02)
    particles.resample(lambda count, _: np.full((count, 3), 9.0))
    assert not (particles.poses == 9.0).any()  # the averages have restarted


def test_scans_count_after_a_motion_or_a_request_only(grid: GridMap, moments: list[Moment]) -> None:
    localizer = Localizer(grid, SETTINGS, ROBOT, np.random.default_rng(6))
    beams = beams_of(moments[0])

    def scan(laser: str, x: float) -> tuple[bool, bool]:
        outcome = localizer.scan(laser, (x, 0.0, 0.0), beams)
        return outcome.is_updated, outcome.estimate is not None

    assert (scan("front", 0.0), scan("front", 0.1)) == ((True, True), (False, False))
    assert scan("front", 0.21) == (True, True)  # the second update resamples
    assert (scan("rear", 0.21), scan("rear", 0.21)) == ((True, False), (False, False))
    localizer.force_update()
    assert scan("rear", 0.21) == (True, True)


def test_parameters_are_read_with_the_rules_of_amcl() -> None:
    given = {"max_particles": 50.4, "odom_frame_id": "/odom", "laser_model_type": "magic", "tf_broadcast": 1}

    settings = read_settings(PrivateParameters(given))

    assert settings.max_particles == 100  # not less than the minimum
    assert (settings.odom_frame_id, settings.laser_model_type) == ("odom", "likelihood_field")
    assert settings.tf_broadcast is True
    with pytest.raises(InvalidParameter, match="~max_particles must be >= 1"):
        checked(replace(settings, max_particles=0, min_particles=0))
    with pytest.raises(InvalidParameter, match="~kld_err must be a finite number"):
        checked(replace(settings, kld_err=math.inf))
