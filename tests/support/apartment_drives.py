"""Drives of a simulated robot through an apartment, many seeds: `python -m tests.support.apartment_drives`.

The first half are plain drives to random goals, none of which may touch a wall. In the second half, two
obstacles walk through the rooms, and the robot is first carried to another place; 9 of 10 must reach the goal
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable

import numpy as np

from pipros.basics.env import Environment
from pipros.launch.roscore import Core
from pipros.libraries.maps.map_file import read_map
from pipros.navigation.plane import Triple
from pipros.navigation.world import NavigationWorld, WorldFailure
from pipros.simulation.robots.obstacle import Obstacle
from pipros.simulation.robots.world import World
from pipros.workspace.index import SHARED_PACKAGES

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START = (2.9, 1.0, 1.2)
WALKS = ([(2.2, 4.2), (8.5, 4.2)], [(5.5, 2.8), (5.0, 1.3), (6.2, 1.3)])
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
    parser.add_argument("--only", choices=("drive", "kidnapped"))
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    seeds = range(given.first, given.first + given.seeds)
    touched = lost = 0
    if given.only != "kidnapped":
        touched = count_failures("drive", drive, seeds)
    if given.only != "drive":
        lost = count_failures("kidnapped among obstacles", kidnapped, seeds)
    return 0 if not touched and lost <= given.seeds // 10 else 1


if __name__ == "__main__":
    sys.exit(main())
