"""Motion and sensor models against closed forms and plain loops."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pipros_robot.navigation.amcl.grid import GridMap
from pipros_robot.navigation.amcl.localizer import moved
from pipros_robot.navigation.amcl.sensors import BeamModel, LikelihoodField, LikelihoodProduct, read_beams
from pipros_robot.navigation.amcl.settings import AmclSettings

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
SETTINGS = AmclSettings(
    laser_z_hit=Z_HIT, laser_z_short=Z_SHORT, laser_z_max=Z_MAX, laser_z_rand=Z_RAND, laser_sigma_hit=SIGMA,
    laser_lambda_short=DECAY, laser_likelihood_max_dist=LIMIT,
)  # fmt: skip


@pytest.fixture
def grid() -> GridMap:
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


def test_the_likelihood_field_is_that_of_a_plain_loop(grid: GridMap, particles: np.ndarray) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)

    found = LikelihoodField(grid, SETTINGS).factors(particles, beams)

    hits = [(r, b) for r, b in used_beams() if r < FAR]
    wanted = [1 + sum(field_probability(end_distance(p, r, b)) ** 3 for r, b in hits) for p in particles]
    assert found == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize(("has_converged", "threshold"), [(False, 0.3), (True, 0.3), (True, 0.9)])
def test_products_and_skipped_beams_are_those_of_a_plain_loop(
    grid: GridMap, particles: np.ndarray, has_converged: bool, threshold: float
) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)
    skipping = {"do_beamskip": True, "beam_skip_distance": 0.4, "beam_skip_threshold": threshold}
    settings = replace(SETTINGS, laser_max_beams=len(RANGES), **skipping)  # type: ignore[arg-type]
    model = LikelihoodProduct(grid, settings)

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


def test_the_beam_model_is_that_of_a_plain_loop(grid: GridMap, particles: np.ndarray) -> None:
    beams = read_beams(RANGES, BEARINGS, LASER, 0.1, FAR)

    found = BeamModel(grid, SETTINGS).factors(particles, beams)

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
