"""The particle filter, and localisation on drives through the apartment."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter, PrivateParameters
from pipros_robot.navigation.amcl.grid import GridMap
from pipros_robot.navigation.amcl.localizer import Localizer, moved
from pipros_robot.navigation.amcl.particles import ParticleFilter, kld_limits
from pipros_robot.navigation.amcl.sensors import (
    BeamModel,
    Beams,
    LikelihoodField,
    LikelihoodProduct,
    read_beams,
)
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


@pytest.mark.parametrize(("laser", "odometry"), [
    ("likelihood_field", "diff-corrected"), ("likelihood_field_prob", "diff"), ("beam", "diff")
])  # fmt: skip
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
    with pytest.raises(InvalidParameter, match="~max_particles must be from 1"):
        checked(replace(settings, max_particles=0, min_particles=0))


# Motion and sensor models against closed forms and plain loops.


ALPHAS = (0.1, 0.2, 0.3, 0.15, 0.25)
BEFORE, AFTER = (1.0, 2.0, 0.4), (1.5, 2.3, 1.0)
DISTANCE, TURN = math.hypot(0.5, 0.3), 0.6
BEARING = math.atan2(0.3, 0.5) - 0.4


def spreads(model: str) -> tuple[float, float, float]:
    """Standard deviations of first turn, distance and second turn (diff) or along, across and turn (omni)."""
    a1, a2, a3, a4, a5 = ALPHAS
    t2, r2 = DISTANCE**2, TURN**2
    if model.startswith("diff"):
        turn1, turn2 = BEARING**2, (TURN - BEARING) ** 2
        found = a1 * turn1 + a2 * t2, a3 * t2 + a4 * (turn1 + turn2), a1 * turn2 + a2 * t2
    elif model == "omni":
        found = a3 * t2 + a1 * r2, a1 * r2 + a5 * t2, a4 * r2 + a2 * t2
    else:
        found = a3 * t2 + a4 * r2, a4 * r2 + a5 * t2, a1 * r2 + a2 * t2
    a, b, c = map(math.sqrt, found) if model.endswith("corrected") else found
    return a, b, c


@pytest.mark.parametrize("model", ["diff", "diff-corrected", "omni", "omni-corrected"])
def test_particles_move_with_the_mean_and_spread_of_the_closed_form(model: str) -> None:
    """The mean of cos of a normal variable is exp(-s²/2) times the cos of its mean."""
    start, count = np.array((3.0, -1.0, 0.7)), 200_000
    particles = np.tile(start, (count, 1))

    found = moved(model, particles, BEFORE, AFTER, ALPHAS, np.random.default_rng(1)) - start

    one, two, three = spreads(model)
    direction = 0.7 + BEARING
    if model.startswith("diff"):
        shrunk = DISTANCE * math.exp(-(one**2) / 2)
        mean = np.array((shrunk * math.cos(direction), shrunk * math.sin(direction)))
        turned_by = math.hypot(one, three)
        along = math.sqrt((DISTANCE**2 + two**2) * (1 + math.exp(-2 * one**2)) / 2 - shrunk**2)
        across = math.sqrt((DISTANCE**2 + two**2) * (1 - math.exp(-2 * one**2)) / 2)
    else:
        mean = DISTANCE * np.array((math.cos(direction), math.sin(direction)))
        along, across, turned_by = one, two, three
    rotation = np.array(
        ((math.cos(direction), math.sin(direction)), (-math.sin(direction), math.cos(direction)))
    )
    local = (found[:, :2] - mean) @ rotation.T
    assert found[:, :2].mean(axis=0) == pytest.approx(mean, abs=0.002)
    assert found[:, 2].mean() == pytest.approx(TURN, abs=0.002)
    assert found[:, 2].std() == pytest.approx(turned_by, rel=0.01)
    assert local.std(axis=0) == pytest.approx((along, across), rel=0.01)


def test_driving_backwards_adds_no_noise_of_a_turn() -> None:
    alphas = (0.5, 0.0, 0.0, 0.5, 0.0)
    particles = np.zeros((100, 3))

    found = moved("diff", particles, (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), alphas, np.random.default_rng(1))

    assert found == pytest.approx(np.tile((-1.0, 0.0, 0.0), (100, 1)))


WALLS = np.zeros((40, 50), np.int8)
WALLS[0], WALLS[-1], WALLS[:, 0], WALLS[:, -1] = 100, 100, 100, 100
WALLS[15:18, 20:30] = 100
WALLS[30:, 5:9] = -1
ORIGIN, SIZE, FAR, LIMIT = (-1.0, 0.5), 0.1, 4.0, 1.5
LASER = (0.1, -0.05)
Z_HIT, Z_SHORT, Z_MAX, Z_RAND, SIGMA, DECAY = 0.8, 0.1, 0.05, 0.06, 0.2, 0.3
MODEL_SETTINGS = AmclSettings(
    laser_z_hit=Z_HIT, laser_z_short=Z_SHORT, laser_z_max=Z_MAX, laser_z_rand=Z_RAND, laser_sigma_hit=SIGMA,
    laser_lambda_short=DECAY, laser_likelihood_max_dist=LIMIT,
)  # fmt: skip


@pytest.fixture
def walls_grid() -> GridMap:
    return GridMap(WALLS, SIZE, ORIGIN)


@pytest.fixture
def particles() -> np.ndarray:
    rng = np.random.default_rng(2)
    return np.column_stack(
        (rng.uniform(-1.2, 4.2, 80), rng.uniform(0.3, 4.7, 80), rng.uniform(-7.0, 7.0, 80))
    )


RANGES = np.array([0.4, 1.3, 3.9, 4.0, 5.0, math.inf, math.nan, 0.05, 2.2, 0.9])
BEARINGS = np.linspace(-2.0, 2.5, len(RANGES))


def cell(x: float, origin: float) -> int:
    return math.floor((x - origin) / SIZE + 0.5)


def end_distance(pose: np.ndarray, reach: float, bearing: float) -> float:
    """Distance from the end of a beam to the nearest occupied cell, by search."""
    x, y, yaw = pose
    x += LASER[0] * math.cos(yaw) - LASER[1] * math.sin(yaw) + reach * math.cos(yaw + bearing)
    y += LASER[0] * math.sin(yaw) + LASER[1] * math.cos(yaw) + reach * math.sin(yaw + bearing)
    column, row = cell(x, ORIGIN[0]), cell(y, ORIGIN[1])
    if not (0 <= column < 50 and 0 <= row < 40):
        return LIMIT
    nearest = min(math.hypot(r - row, c - column) for r, c in np.argwhere(WALLS == 100))
    return min(LIMIT, nearest * SIZE)


def used_beams() -> list[tuple[float, float]]:
    """The ranges after the limits (0.1 to FAR), with their bearings."""
    cleaned = [FAR if r <= 0.1 else math.inf if r > FAR else r for r in RANGES]
    return [(r, b) for r, b in zip(cleaned, BEARINGS, strict=True) if not math.isnan(r)]


def field_probability(distance: float) -> float:
    return Z_HIT * math.exp(-(distance**2) / (2 * SIGMA**2)) + Z_RAND / FAR


def test_the_likelihood_field_is_that_of_a_plain_loop(walls_grid: GridMap, particles: np.ndarray) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)

    found = LikelihoodField(walls_grid, MODEL_SETTINGS).factors(particles, beams)

    hits = [(r, b) for r, b in used_beams() if r < FAR]
    wanted = [1 + sum(field_probability(end_distance(p, r, b)) ** 3 for r, b in hits) for p in particles]
    assert found == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize(("has_converged", "threshold"), [(False, 0.3), (True, 0.3), (True, 0.9)])
def test_products_and_skipped_beams_are_those_of_a_plain_loop(
    walls_grid: GridMap, particles: np.ndarray, has_converged: bool, threshold: float
) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)
    skipping = {"do_beamskip": True, "beam_skip_distance": 0.4, "beam_skip_threshold": threshold}
    settings = replace(MODEL_SETTINGS, laser_max_beams=len(RANGES), **skipping)  # type: ignore[arg-type]
    model = LikelihoodProduct(walls_grid, settings)

    found = model.factors(particles, beams, has_converged=has_converged)

    hits = [(r, b) for r, b in used_beams() if r < FAR]
    distances = [[end_distance(p, r, b) for r, b in hits] for p in particles]
    kept = [np.mean([row[i] < 0.4 for row in distances]) > threshold for i in range(len(hits))]
    if not has_converged or len(RANGES) - sum(kept) >= 0.9 * len(RANGES):
        kept = [True] * len(hits)
    wanted = [
        math.prod(field_probability(d) for d, is_kept in zip(row, kept, strict=True) if is_kept)
        for row in distances
    ]
    assert found == pytest.approx(wanted, rel=1e-5)


def expected_range(x: float, y: float, angle: float) -> float:
    """The first cell that is not free on Bresenham's line, cell by cell."""
    column, row = cell(x, ORIGIN[0]), cell(y, ORIGIN[1])
    end = cell(x + FAR * math.cos(angle), ORIGIN[0]), cell(y + FAR * math.sin(angle), ORIGIN[1])
    start, target = (column, row), end
    is_steep = abs(target[1] - start[1]) > abs(target[0] - start[0])
    if is_steep:
        start, target = start[::-1], target[::-1]
    long, wide = abs(target[0] - start[0]), abs(target[1] - start[1])
    along, aside = (1 if target[i] > start[i] else -1 for i in (0, 1))
    place, error = list(start), 0
    while True:
        column, row = place[::-1] if is_steep else place
        if not (0 <= column < 50 and 0 <= row < 40) or WALLS[row, column] != 0:
            return math.hypot(place[0] - start[0], place[1] - start[1]) * SIZE
        if place[0] == target[0] + along:
            return FAR
        place[0] += along
        error += wide
        if 2 * error >= long:
            place[1] += aside
            error -= long


def test_the_beam_model_is_that_of_a_plain_loop(walls_grid: GridMap, particles: np.ndarray) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)

    found = BeamModel(walls_grid, MODEL_SETTINGS).factors(particles, beams)

    def probability(pose: np.ndarray, measured: float, bearing: float) -> float:
        x, y, yaw = pose
        x += LASER[0] * math.cos(yaw) - LASER[1] * math.sin(yaw)
        y += LASER[0] * math.sin(yaw) + LASER[1] * math.cos(yaw)
        error = measured - expected_range(x, y, yaw + bearing)
        total = Z_HIT * math.exp(-(error**2) / (2 * SIGMA**2))
        total += Z_SHORT * DECAY * math.exp(-DECAY * measured) if error < 0 else 0.0
        return total + (Z_MAX if measured == FAR else 0.0) + (Z_RAND / FAR if measured < FAR else 0.0)

    wanted = [1 + sum(probability(p, r, b) ** 3 for r, b in used_beams()) for p in particles]
    assert found == pytest.approx(wanted)
