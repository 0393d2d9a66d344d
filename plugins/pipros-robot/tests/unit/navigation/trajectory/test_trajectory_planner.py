"""The scores of TrajectoryPlannerROS beside obstacles, in cells and in metres."""

from dataclasses import replace

import numpy as np
import pytest

from pipros_robot.navigation.costmap.grid import CostGrid
from pipros_robot.navigation.trajectory.planner import TrajectoryPlanner
from pipros_robot.navigation.trajectory.settings import TrajectorySettings

FOOTPRINT = [(-0.1, -0.1), (-0.1, 0.1), (0.1, 0.1), (0.1, -0.1)]
SETTINGS = TrajectorySettings(holonomic_robot=False, path_distance_bias=0.7, goal_distance_bias=0.0)
START, STILL = (0.025, 0.025, 0.0), (0.3, 0.0, 0.0)


def planner(settings: TrajectorySettings) -> TrajectoryPlanner:
    """Return a planner on a grid of 3 x 3 m with costs of 200 from y = 0.2 m on, and a plan along x."""
    grid = CostGrid()
    grid.resize(60, 60, 0.05, -1.5, -1.5)
    grid.costs[34:] = 200
    made = TrajectoryPlanner(settings)
    made.look_at(grid, FOOTPRINT, START, [(0.025, 0.025), (1.025, 0.025)])
    return made


def test_scores_are_weighted_distances_and_costs() -> None:
    choice = planner(SETTINGS).choose(START, STILL)

    tried = choice.tried
    last = np.arange(len(tried)), tried.counts - 1
    is_part = np.arange(tried.x.shape[1]) < tried.counts[:, None]
    corner = tried.y + 0.1 * (np.abs(np.sin(tried.yaw)) + np.abs(np.cos(tried.yaw)))
    highest = np.where(is_part, corner, -9.0).max(axis=1)
    rows = np.abs(np.floor(tried.y[last] / 0.05))
    known = (tried.x[last] < 1.0) & (tried.x[last] > 0.0) & (np.abs(highest - 0.2) > 1e-6)
    wanted = 0.7 * rows + 0.01 * 200 * (highest > 0.2)
    assert known.sum() > 100
    assert 0 < (highest[known] > 0.2).mean() < 1
    assert choice.scores[known] == pytest.approx(wanted[known])
    best = planner(SETTINGS).choose(START, STILL, only_best=True)
    is_scored = best.scores != np.inf
    assert 0 < is_scored.mean() < 1
    assert best.command == choice.command
    assert (best.scores[is_scored] == choice.scores[is_scored]).all()


def test_scoring_in_metres_keeps_the_relation_of_distances_to_costs() -> None:
    """Otherwise, costs count twenty times as much, and a robot stands still before a door."""
    cells = planner(SETTINGS).choose(START, STILL)
    metres = planner(replace(SETTINGS, meter_scoring=True)).choose(START, STILL)

    assert metres.scores == pytest.approx(cells.scores * np.where(cells.scores < 0, 1.0, 0.05))
    assert metres.command == cells.command


def test_a_car_neither_turns_in_place_nor_drives_sideways() -> None:
    settings = replace(SETTINGS, holonomic_robot=True, min_turning_radius=1.0)
    choice = planner(settings).choose(START, STILL)
    legal = choice.tried.goals[choice.scores >= 0]
    assert len(legal)
    assert not legal[:, 1].any()
    assert (np.abs(legal[:, 2]) <= np.abs(legal[:, 0]) + 1e-9).all()
    assert planner(settings).settings.yaw_goal_tolerance == np.pi
