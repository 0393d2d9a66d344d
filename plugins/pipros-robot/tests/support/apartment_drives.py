"""Drives of a simulated robot through an apartment, many seeds: `python -m tests.support.apartment_drives`.

The first half are plain drives to random goals, none of which may touch a wall. In the second half, two
obstacles walk through the rooms, and the robot is first carried to another place; 9 of 10 must reach the
goal. Then ten seeds drive to ten random goals each among the same obstacles; 97 of 100 must be reached
without touching anything. Then five seeds map the apartment with slam_gmapping's 30 particles: of the cells
that are free in the map or in the apartment, more than 93 % must be free in both, and 93 % of the occupied
cells at most one cell from a wall.
"""

import argparse
import logging
import math
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
GOALS = 10
"""Goals of a drive among obstacles."""
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


def drive(world: NavigationWorld, seed: int) -> int:
    """Drive to a random goal without touching a wall. Return how many goals were reached."""
    with world.never_closer_than(1e-6):
        world.reaches(*places(seed, 1)[0], within_s=120)
    errors_m, errors_rad = np.percentile(np.array(world.errors), 95, axis=0)
    if errors_m > 0.1 or errors_rad > np.radians(3):
        raise WorldFailure(f"95 % of the estimates within {errors_m:.2f} m, {errors_rad:.3f} rad")
    return 1


def kidnapped(world: NavigationWorld, seed: int) -> int:
    """Carry the robot away among walking obstacles, then drive to a random goal."""
    elsewhere, goal = places(1000 + seed, 2)
    world.run_for(1.0)
    world.recovers_from_kidnapping(*elsewhere, within_s=120)
    world.reaches(*goal, within_s=180)
    return 1


def goals(world: NavigationWorld, seed: int) -> int:
    """Drive to ten random goals among walking obstacles."""
    reached = 0
    for goal in places(2000 + seed, GOALS):
        try:
            with world.never_closer_than(1e-6):
                world.reaches(*goal, within_s=180)
            reached += 1
        except WorldFailure as failure:
            print(f"    {failure}")
    return reached


def missed(run: Callable[[NavigationWorld, int], int], seeds: range, *, of: int = 1, walks: Any = ()) -> int:
    """Drive with each seed to so many goals, and return how many were missed."""
    reached, simulated_s = 0, 0.0
    for seed in seeds:
        obstacles = [Obstacle(points, 0.2, 0.3) for points in walks]
        with Core(port=0, rosout=False, environment=Environment.from_os()) as core:
            world = NavigationWorld(core.uri, APARTMENT, start=START, seed=seed, obstacles=obstacles)
            try:
                found = run(world, seed)
            except WorldFailure as failure:
                found = 0
                print(f"    {failure}")
            finally:
                world.close()
        reached += found
        simulated_s += world.time_s
        print(f"{run.__name__}, seed {seed}: {found} of {of}; {world.report}", flush=True)
    print(
        f"{run.__name__}: {reached} of {of * len(seeds)}, {simulated_s:.0f} s of simulated time", flush=True
    )
    return of * len(seeds) - reached


def count_bad_maps(seeds: range) -> int:
    """Map the apartment on a drive of 30 m, with 2 % noise in the odometry."""
    begin, angles = Pose(2.9, 1.0, 0.0), math.tau / 180 * np.arange(180)
    size: Any = {"xmin": -8.0, "ymin": -8.0, "xmax": 12.0, "ymax": 12.0}
    noise: Any = {"srr": 0.02, "srt": 0.04, "str": 0.02, "stt": 0.04}
    settings = MappingSettings(particles=30, linearUpdate=0.3, angularUpdate=0.2, **size, **noise)
    settings = settings.with_ranges(10.0)
    failures = 0
    for seed in seeds:
        slam = GridSlam(settings, angles, (0.0, 0.0, 0.0), np.random.default_rng(seed))
        survey = Survey(settings, angles)
        for moment in drives.drive(start=begin, noise=0.02, seed=seed):
            odometry = moment.odometry.x, moment.odometry.y, moment.odometry.yaw
            slam.scan(odometry, moment.ranges, moment.time_s)
        survey.follow(slam.steps[slam.best])
        found = drives.agreement(survey.values(), survey.origin, begin)
        is_good = found.free_iou > 0.93 and found.walls_near > 0.93
        failures += not is_good
        print(f"map, seed {seed}: {'good' if is_good else 'bad'}; {found}", flush=True)
    return failures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", choices=("drive", "kidnapped", "goals", "map"))
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    seeds, few, five = (range(given.first, given.first + min(given.seeds, most)) for most in (1000, 10, 5))
    parts: dict[str, Callable[[], bool]] = {
        "drive": lambda: not missed(drive, seeds),
        "kidnapped": lambda: missed(kidnapped, seeds, walks=WALKS) <= len(seeds) // 10,
        "goals": lambda: missed(goals, few, of=GOALS, walks=WALKS) <= 3 * len(few) // 10,
        "map": lambda: not count_bad_maps(five),
    }
    wrong = [name for name, is_good in parts.items() if given.only in (None, name) and not is_good()]
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
