"""The planner against a plain loop over velocities, poses and cells."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.costmap.grid import CostGrid
from pipros_robot.navigation.dwa import grid_costs
from pipros_robot.navigation.dwa.goal_rotation import STILL, GoalRotation
from pipros_robot.navigation.dwa.planner import DwaPlanner
from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.dwa.trajectories import sampled, simulated, window

FOOTPRINT = [(-0.2, -0.15), (-0.2, 0.15), (0.08, 0.15), (0.08, -0.15)]
SETTINGS = DwaSettings(
    min_vel_x=-0.2, max_vel_y=0.0, min_vel_y=0.0, vx_samples=7, vy_samples=1, vth_samples=9, sim_period=0.1
)
RESOLUTION, SIZE, CORNER = 0.05, 60, -1.5


def grid_of(seed: int) -> CostGrid:
    """Return a map with some blocks, their surroundings, and unknown cells."""
    random = np.random.default_rng(seed)
    grid = CostGrid()
    grid.resize(SIZE, SIZE, RESOLUTION, CORNER, CORNER)
    grid.costs[:] = random.integers(0, 60, grid.costs.shape)
    for _ in range(6):
        row, column = random.integers(0, SIZE - 6, 2)
        if abs(row - 30) + abs(column - 30) > 14:
            grid.costs[row : row + 6, column : column + 6] = 253
            grid.costs[row + 1 : row + 5, column + 1 : column + 5] = 254
    grid.costs[:4] = 255
    return grid


def cell_of(x: float, y: float) -> tuple[int, int] | None:
    column, row = math.floor((x - CORNER) / RESOLUTION), math.floor((y - CORNER) / RESOLUTION)
    return (row, column) if 0 <= row < SIZE and 0 <= column < SIZE else None


def plain_distances(grid: CostGrid, targets: list[tuple[int, int]]) -> dict[tuple[int, int], int]:
    """Return the distance of each cell by a breadth-first search."""
    found = dict.fromkeys(targets, 0)
    queue = deque(found)
    while queue:
        row, column = queue.popleft()
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if cell not in found and 0 <= cell[0] < SIZE and 0 <= cell[1] < SIZE:
                is_wall = grid.costs[cell] >= 253
                found[cell] = SIZE * SIZE if is_wall else found[row, column] + 1
                if not is_wall:
                    queue.append(cell)
    return found


def line(start: tuple[int, int], end: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the cells between two cells, with Bresenham's integer algorithm."""
    (row, column), cells = start, [start]
    rows, columns = abs(end[0] - row), abs(end[1] - column)
    up, right = (1 if end[0] >= row else -1), (1 if end[1] >= column else -1)
    longer, shorter = max(rows, columns), min(rows, columns)
    rest = longer // 2
    for _ in range(longer):
        rest += shorter
        if columns >= rows:
            column += right
        else:
            row += up
        if rest >= longer:
            rest -= longer
            if columns >= rows:
                row += up
            else:
                column += right
        cells.append((row, column))
    return cells


def outline_cost(grid: CostGrid, x: float, y: float, yaw: float, factor: float) -> int | None:
    """Return the greatest cost under the footprint and the centre, or None for a collision."""
    cos, sin = math.cos(yaw) * factor, math.sin(yaw) * factor
    corners = [cell_of(x + a * cos - b * sin, y + a * sin + b * cos) for a, b in FOOTPRINT]
    centre = cell_of(x, y)
    if centre is None or None in corners:
        return None
    known: list[Any] = corners
    cells = [cell for one, two in zip(known, known[1:] + known[:1], strict=True) for cell in line(one, two)]
    costs = [int(grid.costs[cell]) for cell in cells]
    return None if max(costs) >= 254 else max(*costs, int(grid.costs[centre]))


def plain_score(
    settings: DwaSettings, grid: CostGrid, maps: list[Any], pose: Any, goal: Any, command: Any
) -> float | None:
    """Return the score of one velocity, or None if it is discarded."""
    vx, vy, turn = command
    speed = math.hypot(vx, vy)
    if (
        speed + 1e-4 < settings.min_vel_trans and abs(turn) + 1e-4 < settings.min_vel_theta
    ) or speed - 1e-4 > settings.max_vel_trans:
        return None
    length = max(speed / settings.sim_granularity, abs(turn) / settings.angular_sim_granularity)
    steps = math.ceil(length * settings.sim_time)
    if not steps:
        return None
    poses = [pose]
    for _ in range(steps - 1):
        x, y, yaw = poses[-1]
        dt = settings.sim_time / steps
        poses.append((x + vx * math.cos(yaw) * dt, y + vx * math.sin(yaw) * dt, yaw + turn * dt))
    factor = 1.0
    if speed > settings.scaling_speed:
        share = (speed - settings.scaling_speed) / (settings.max_vel_trans - settings.scaling_speed)
        factor += settings.max_scaling_factor * share
    costs = [outline_cost(grid, *each, factor) for each in poses]
    path, target, nose = maps
    ahead = settings.forward_point_distance
    fronts = [cell_of(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw)) for x, y, yaw in poses]
    if None in costs or None in fronts:
        return None
    cells: list[Any] = [cell_of(x, y) for x, y, _ in poses]
    if any(each.get(cell, 9999) >= SIZE * SIZE for each in (path, target) for cell in cells):
        return None
    scale, last, front = RESOLUTION, cells[-1], fronts[-1]
    unreached = SIZE * SIZE + 1
    score = (
        settings.path_distance_bias * scale * path[last] + settings.goal_distance_bias * scale * target[last]
    )
    score += settings.goal_distance_bias * scale * nose.get(front, unreached)
    if math.dist(goal, pose[:2]) > ahead:
        score += settings.path_distance_bias * scale * path.get(front, unreached)
    return score + settings.occdist_scale * max(cost for cost in costs if cost is not None)


@pytest.mark.parametrize("seed", range(6))
def test_the_choice_and_all_scores_equal_those_of_a_plain_loop(seed: int, monkeypatch) -> None:
    if seed % 2:  # as for long edges
        monkeypatch.setattr(grid_costs, "KNOWN_LINES", 0)
    grid, pose, velocity = grid_of(seed), (0.02, -0.04, seed - 2.5), (0.3, 0.0, 0.2)
    settings = replace(SETTINGS, occdist_scale=0.02, path_distance_bias=0.6 + seed)
    plan = [(0.05 * step * math.cos(seed), 0.05 * step * math.sin(seed)) for step in range(19)]
    planner = DwaPlanner(settings)

    planner.look_at(grid, FOOTPRINT, pose, plan)
    best = planner.choose(pose, velocity, only_best=True)
    planner.start_plan()
    choice = planner.choose(pose, velocity)

    is_scored = best.scores != np.inf
    assert best.command == choice.command
    assert (best.scores[is_scored] == choice.scores[is_scored]).all()
    on_plan = [cell for x, y in plan if (cell := cell_of(x, y)) is not None]
    goal = plan[-1]
    angle = math.atan2(goal[1] - pose[1], goal[0] - pose[0])
    front = cell_of(goal[0] + 0.325 * math.cos(angle), goal[1] + 0.325 * math.sin(angle))
    assert front is not None
    maps = [plain_distances(grid, targets) for targets in (on_plan, on_plan[-1:], [front])]
    scores = {
        (vx, 0.0, turn): plain_score(settings, grid, maps, pose, goal, (vx, 0.0, turn))
        for vx in sampled(0.05, 0.55, 7)
        for turn in sampled(-0.12, 0.52, 9)
    }
    legal = {command: score for command, score in scores.items() if score is not None}
    found = {
        tuple(command): score
        for command, score in zip(choice.tried.commands.tolist(), choice.scores.tolist(), strict=True)
        if score >= 0
    }
    assert sorted(found.values()) == pytest.approx(sorted(legal.values()))
    if legal:
        assert choice.command == pytest.approx(min(legal, key=lambda command: legal[command]))
    else:
        assert choice.command is None


@pytest.mark.parametrize("measured", [(0.9, 0.0, 3.0), (-0.9, 0.0, -3.0)])
def test_no_velocity_exceeds_the_limits_even_if_a_measured_one_does(measured: Any) -> None:
    x, _, turn = window(SETTINGS, (0.0, 0.0, 0.0), measured, (1.0, 0.0)).T
    assert x.min() >= SETTINGS.min_vel_x
    assert x.max() <= SETTINGS.max_vel_x
    assert np.abs(turn).max() <= SETTINGS.max_vel_theta


def test_without_the_window_the_robot_accelerates_towards_each_velocity() -> None:
    settings = replace(SETTINGS, use_dwa=False, sim_time=1.0, acc_lim_x=0.5, sim_granularity=0.05)
    still = (0.0, 0.0, 0.0)
    assert window(settings, still, still, (0.3, 0.0))[:, 0].max() == pytest.approx(0.3), "the goal's distance"

    tried = simulated(settings, still, still, np.array([[0.5, 0.0, 0.0]]))

    way = tried.way(0)  # 10 steps of 0.1 s; the velocity rises by 0.05 m/s per step
    assert (len(way), tried.commands[0, 0]) == (10, pytest.approx(0.05))
    speeds = [min(0.5, 0.05 * (step + 2)) for step in range(9)]
    assert way[-1, 0] == pytest.approx(sum(speed * 0.1 for speed in speeds))


def test_after_a_change_of_direction_the_old_one_is_banned_until_the_robot_has_moved() -> None:
    grid = CostGrid()
    grid.resize(120, 120, 0.05, -3.0, -3.0)
    planner = DwaPlanner(replace(SETTINGS, min_vel_x=-0.5))
    ahead, behind = [(0.0, 0.0), (1.0, 0.0)], [(0.0, 0.0), (-1.0, 0.0)]

    def velocity(pose: tuple[float, float, float], plan: list[tuple[float, float]]) -> float:
        planner.look_at(grid, FOOTPRINT, pose, plan)
        command = planner.choose(pose, (0.0, 0.0, 0.0)).command
        assert command is not None
        return command[0]

    start = (0.0, 0.0, 0.0)
    assert velocity(start, ahead) > 0
    assert velocity(start, behind) < 0
    assert velocity(start, ahead) < 0, "forwards is banned"
    assert velocity((-0.06, 0.0, 0.0), ahead) < 0, "the ban ends after this cycle"
    assert velocity((-0.06, 0.0, 0.0), ahead) > 0
    assert velocity((-0.06, 0.0, 0.0), behind) < 0
    planner.start_plan()
    assert velocity((-0.06, 0.0, 0.0), ahead) > 0, "a new plan ends the bans"


def test_a_robot_without_footprint_is_a_point_and_a_closed_cell_stops_it() -> None:
    grid = grid_of(0)
    planner = DwaPlanner(SETTINGS)
    planner.look_at(grid, [], (0.0, 0.0, 0.0), [(0.0, 0.0), (0.5, 0.0)])
    assert planner.choose((0.0, 0.0, 0.0), (0.2, 0.0, 0.0)).command is not None
    assert planner.is_legal((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    grid.costs[26:34, 26:34] = 253
    planner.look_at(grid, [], (0.0, 0.0, 0.0), [(0.0, 0.0), (0.5, 0.0)])
    assert planner.choose((0.0, 0.0, 0.0), (0.2, 0.0, 0.0)).command is None
    assert not planner.is_legal((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.5))


@pytest.mark.parametrize(("given", "why"), [
    ({"sim_time": 0.0}, "sim_time must be > 0 and finite, got 0.0"),
    ({"path_distance_bias": math.inf}, "path_distance_bias must be from -1e9 to 1e9, got inf"),
    ({"vx_samples": 10**6}, "at most 2,000,000 are allowed"),
    ({"sim_granularity": 1e-9}, "at most 2,000,000 are allowed"),
])  # fmt: skip
def test_settings_that_would_need_too_much_are_refused(given: dict[str, Any], why: str) -> None:
    with pytest.raises(InvalidParameter, match=why):
        DwaSettings.of(given)


@pytest.mark.parametrize("use_dwa", [True, False])
def test_a_car_never_turns_more_sharply_than_its_radius(use_dwa: bool) -> None:
    free = CostGrid()
    free.resize(SIZE, SIZE, RESOLUTION, CORNER, CORNER)
    plan = [(0.0, 0.05 * step) for step in range(20)]  # to the left of the robot
    radii = {}
    for radius in (0.0, 1.0):
        settings = replace(SETTINGS, min_turning_radius=radius, use_dwa=use_dwa, max_vel_theta=2.0)
        planner = DwaPlanner(settings)
        planner.look_at(free, FOOTPRINT, (0.0, 0.0, 0.0), plan)
        choice = planner.choose((0.0, 0.0, 0.0), (0.3, 0.0, 0.2))
        legal = choice.tried.commands[choice.scores >= 0]
        radii[radius] = (np.abs(legal[:, 0]) / np.maximum(np.abs(legal[:, 2]), 1e-9)).min()
        for move in ((0.0, 0.0, 0.5), (0.0, 0.1, 0.0)):
            assert planner.is_legal((0, 0, 0), (0, 0, 0), move) == (not radius)
    assert radii[0.0] < 0.99 <= radii[1.0]


def test_a_car_is_at_its_goal_in_any_direction() -> None:
    values = {"yaw_goal_tolerance": 0.1}
    assert DwaSettings.of(values, min_turning_radius=1.0).yaw_goal_tolerance == math.pi
    assert DwaSettings.of(values).yaw_goal_tolerance == 0.1


# Stopping and turning at the goal.


ROTATION = DwaSettings(sim_period=0.1)
GOAL = (1.0, 1.0, 0.0)
YES: Callable[[object], bool] = lambda _: True  # noqa: E731


def test_the_robot_brakes_then_turns_then_stands() -> None:
    rotation = GoalRotation(ROTATION, is_latching=False)
    at_goal = (1.05, 1.0, -1.0)

    assert rotation.command(at_goal, (0.4, 0.0, 0.5), GOAL, YES) == pytest.approx((0.15, 0.0, 0.18))
    assert rotation.command(at_goal, STILL, GOAL, YES) == pytest.approx((0.0, 0.0, 0.4))
    assert rotation.command(at_goal, (0.0, 0.0, 0.9), GOAL, YES) == pytest.approx((0.0, 0.0, 1.0))
    assert rotation.command((1.0, 1.0, 1.0), (0.0, 0.0, 0.9), GOAL, YES) == pytest.approx((0.0, 0.0, -1.0))
    assert rotation.command((1.0, 1.0, -0.05), STILL, GOAL, YES) == STILL
    assert rotation.command(at_goal, STILL, GOAL, lambda _: False) is None


def test_the_goal_is_reached_in_its_direction_and_standing() -> None:
    rotation = GoalRotation(ROTATION, is_latching=False)

    assert rotation.has_reached((1.05, 1.05, 0.05), STILL, GOAL)
    assert rotation.has_reached((1.0, 1.0, math.tau), (0.1, 0.0, 0.1), GOAL)
    assert not rotation.has_reached((1.05, 1.05, 0.15), STILL, GOAL)
    assert not rotation.has_reached((1.2, 1.0, 0.0), STILL, GOAL)
    assert not rotation.has_reached((1.0, 1.0, 0.0), (0.2, 0.0, 0.0), GOAL)


@pytest.mark.parametrize("is_latching", [True, False])
def test_a_latched_goal_stays_reached_until_the_next_plan(is_latching: bool) -> None:
    rotation = GoalRotation(ROTATION, is_latching=is_latching)
    assert rotation.is_there((1.0, 1.0, 2.0), GOAL)
    assert rotation.is_there((1.3, 1.0, 2.0), GOAL) == is_latching
    rotation.start_plan()
    assert not rotation.is_there((1.3, 1.0, 2.0), GOAL)
