"""Drives of a simulated robot through an apartment, many seeds: `python -m tests.support.apartment_drives`.

The first half are plain drives to random goals, none of which may touch a wall. In the second half, two
obstacles walk through the rooms, and the robot is first carried to another place; 9 of 10 must reach the
goal. Then ten seeds drive to ten random goals each among the same obstacles; 97 of 100 must be reached
without touching anything. Then five seeds map the apartment with slam_gmapping's 30 particles: of the cells
that are free in the map or in the apartment, more than 93 % must be free in both, and 93 % of the occupied
cells at most one cell from a wall.
"""

from __future__ import annotations

import argparse
import logging
import math
import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from pipros.basics.env import Environment
from pipros_libraries.maps.map_file import read_map
from pipros_robot.navigation.mapping.settings import MappingSettings
from pipros_robot.navigation.mapping.slam import GridSlam
from pipros_robot.navigation.mapping.survey import Survey
from pipros_robot.navigation.plane import Triple
from pipros_robot.navigation.world import NavigationWorld, WorldFailure
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.obstacle import Obstacle
from pipros_simulation.robots.world import World
from pipros_tools.launch.roscore import Core
from pipros_workspace.index import SHARED_PACKAGES
from tests.support import drives

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START = (2.9, 1.0, 1.2)
WALKS = ([(2.2, 4.2), (8.5, 4.2)], [(5.5, 2.8), (5.0, 1.3), (6.2, 1.3)])
GOALS, MISSED = 10, 3
"""Goals of a drive among obstacles, and how many of ten such drives may be missed."""
ROOM_M = 0.35
"""Distance to walls of the random places."""


def places(seed: int, count: int) -> list[Triple]:
    """Return random poses with room around them."""
    world = World.from_grid(read_map(APARTMENT))
    random = np.random.default_rng(seed)
    cells = world.free_cells()
    found: list[Triple] = []
    while len(found) < count:
        x, y = map(float, cells[random.integers(len(cells))])
        if world.is_free(x, y, ROOM_M):
            found.append((x, y, float(random.uniform(-3, 3))))
    return found


def drive(seed: int) -> tuple[str, NavigationWorld]:
    """Drive to a random goal. Return the problem, if any, and the world."""
    (goal,) = places(seed, 1)
    world = NavigationWorld(os.environ["ROS_MASTER_URI"], APARTMENT, start=START, seed=seed)
    try:
        with world.never_closer_than(1e-6):
            world.reaches(*goal, within_s=120)
        errors_m, errors_rad = np.percentile(np.array(world.errors), 95, axis=0)
        wrong = errors_m > 0.1 or errors_rad > np.radians(3)
        return f"95 % of the estimates within {errors_m:.2f} m, {errors_rad:.3f} rad" if wrong else "", world
    except WorldFailure as failure:
        return str(failure), world
    finally:
        world.close()


def kidnapped(seed: int) -> tuple[str, NavigationWorld]:
    """Carry the robot away among walking obstacles, then drive to a random goal."""
    elsewhere, goal = places(1000 + seed, 2)
    obstacles = [Obstacle(points, 0.2, 0.3) for points in WALKS]
    master = os.environ["ROS_MASTER_URI"]
    world = NavigationWorld(master, APARTMENT, start=START, seed=seed, obstacles=obstacles)
    try:
        world.run_for(1.0)
        world.recovers_from_kidnapping(*elsewhere, within_s=120)
        world.reaches(*goal, within_s=180)
        return "", world
    except WorldFailure as failure:
        return str(failure), world
    finally:
        world.close()


def count_missed_goals(seeds: range) -> int:
    """Drive to ten random goals among walking obstacles, with each seed."""
    missed = 0
    for seed in seeds:
        obstacles, problems = [Obstacle(points, 0.2, 0.3) for points in WALKS], []
        with Core(port=0, rosout=False, environment=Environment.from_os()) as core:
            world = NavigationWorld(core.uri, APARTMENT, start=START, seed=seed, obstacles=obstacles)
            try:
                for goal in places(2000 + seed, GOALS):
                    try:
                        with world.never_closer_than(1e-6):
                            world.reaches(*goal, within_s=180)
                    except WorldFailure as failure:
                        problems.append(str(failure))
            finally:
                world.close()
        missed += len(problems)
        errors_m, errors_rad = np.percentile(np.array(world.errors), 95, axis=0)
        print(
            f"goals among obstacles, seed {seed}: {GOALS - len(problems)} of {GOALS}, 95 % of the estimates "
            f"within {errors_m:.2f} m, {errors_rad:.3f} rad; {world.report}",
            *problems,
            sep="\n    ",
            flush=True,
        )
    print(f"goals among obstacles: {len(seeds) * GOALS - missed} of {len(seeds) * GOALS}", flush=True)
    return missed


def count_bad_maps(seeds: range) -> int:
    """Map the apartment on a drive of 30 m, with 2 % noise in the odometry."""
    begin, angles = Pose(2.9, 1.0, 0.0), math.tau / 180 * np.arange(180)
    size: Any = {"xmin": -8.0, "ymin": -8.0, "xmax": 12.0, "ymax": 12.0}
    noise: Any = {"srr": 0.02, "srt": 0.04, "str": 0.02, "stt": 0.04}
    settings = MappingSettings(
        particles=30, linearUpdate=0.3, angularUpdate=0.2, **size, **noise
    ).with_ranges(10.0)
    failures = 0
    for seed in seeds:
        slam, survey = (
            GridSlam(settings, angles, (0.0, 0.0, 0.0), np.random.default_rng(seed)),
            Survey(settings, angles),
        )
        for moment in drives.drive(start=begin, noise=0.02, seed=seed):
            odometry = moment.odometry.x, moment.odometry.y, moment.odometry.yaw
            slam.scan(odometry, moment.ranges, moment.time_s)
        survey.follow(slam.steps[slam.best])
        found = drives.agreement(survey.values(), survey.origin, begin)
        is_good = found.free_iou > 0.93 and found.walls_near > 0.93
        failures += not is_good
        print(
            f"map, seed {seed}: {'good' if is_good else 'bad'}; IoU of free cells {found.free_iou:.3f}, "
            f"occupied cells within one cell of a wall {found.walls_near:.1%}, "
            f"walls within one cell of an occupied cell {found.walls_seen:.1%}",
            flush=True,
        )
    return failures


def count_failures(name: str, run: Callable[[int], tuple[str, NavigationWorld]], seeds: range) -> int:
    failures = 0
    simulated = 0.0
    for seed in seeds:
        with Core(port=0, rosout=False, environment=Environment.from_os()) as core:
            os.environ["ROS_MASTER_URI"] = core.uri
            problem, world = run(seed)
        os.environ.pop("ROS_MASTER_URI")
        simulated += world.time_s
        failures += bool(problem)
        print(f"{name}, seed {seed}: {problem or 'reached'}; {world.report}", flush=True)
    print(f"{name}: {len(seeds) - failures} of {len(seeds)}, {simulated:.0f} s of simulated time", flush=True)
    return failures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", choices=("drive", "kidnapped", "goals", "map"))
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    seeds = range(given.first, given.first + given.seeds)
    touched = lost = missed = bad = 0
    if given.only in (None, "drive"):
        touched = count_failures("drive", drive, seeds)
    if given.only in (None, "kidnapped"):
        lost = count_failures("kidnapped among obstacles", kidnapped, seeds)
    if given.only in (None, "goals"):
        missed = count_missed_goals(range(given.first, given.first + min(10, given.seeds)))
    if given.only in (None, "map"):
        bad = count_bad_maps(range(given.first, given.first + min(5, given.seeds)))
    return 0 if not touched and lost <= given.seeds // 10 and missed <= MISSED and not bad else 1


if __name__ == "__main__":
    sys.exit(main())
