#!/usr/bin/env python3
"""Processor time of the operations of navigation.

    script/bench navigation [--repetitions 500]

The median of all repetitions, or of those that fit into five seconds, counts. Other programs hardly disturb
it: only the processor time of this process is measured, in one thread.
"""

import itertools
import math
import os
import statistics
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from pipros.navigation.amcl.grid import GridMap
from pipros.navigation.amcl.localizer import Localizer
from pipros.navigation.amcl.sensors import read_beams
from pipros.navigation.amcl.settings import AmclSettings, Belief
from pipros.navigation.costmap.footprint import circle
from pipros.navigation.costmap.grid import LETHAL, CostGrid
from pipros.navigation.costmap.inflation_layer import InflationLayer
from pipros.navigation.costmap.layered import CellRectangle, LayeredCostmap, Pose2D
from pipros.navigation.costmap.observations import ObservationSource, SourceSettings
from pipros.navigation.costmap.obstacle_layer import ObstacleLayer
from pipros.navigation.dwa.planner import DwaPlanner
from pipros.navigation.dwa.settings import DwaSettings
from pipros.navigation.filter.kalman import ExtendedKalmanFilter
from pipros.navigation.filter.state import SIZE, Measurement
from pipros.navigation.filter.unscented import UnscentedKalmanFilter
from pipros.navigation.mapping.settings import MappingSettings
from pipros.navigation.mapping.slam import GridSlam
from pipros.navigation.mapping.survey import Survey
from pipros.navigation.navfn.plan import plan
from pipros.navigation.trajectory.planner import TrajectoryPlanner
from pipros.navigation.trajectory.settings import TrajectorySettings

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "build"))
from table import options_of

from tests.support.drives import drive

FOOTPRINT = [(-0.105, -0.105), (-0.105, 0.105), (0.041, 0.105), (0.041, -0.105)]

MOST_MS = 5_000
"""Time after which an operation is not repeated."""


def median_ms(work, repetitions):
    """Return the median processor time of `work()` in milliseconds."""
    taken = []
    while len(taken) < repetitions and sum(taken) < MOST_MS:
        began = time.process_time_ns()
        work()
        taken.append((time.process_time_ns() - began) / 1e6)
    return statistics.median(taken)


def filter_step(kalman):
    """Return a function that predicts by 33 ms and corrects with 12 variables."""
    flags = np.zeros(SIZE, bool)
    flags[:12] = True
    values = np.random.default_rng(1).normal(0.0, 0.1, SIZE)
    measurement = Measurement("odom0", 0.0, values, np.eye(SIZE) * 0.1, flags)

    def step():
        kalman.predict(0.0, 0.033)
        kalman.correct(measurement)

    return step


def amcl_update(laser_model):
    """Return a function that moves, weighs and resamples 2,000 particles with 60 beams, and clusters them."""
    rng = np.random.default_rng(1)
    cells = np.where(rng.random((400, 400)) < 0.01, 100, 0).astype(np.int8)
    settings = AmclSettings(
        min_particles=2000,
        max_particles=2000,
        laser_max_beams=60,
        resample_interval=1,
        update_min_d=0.0,
        laser_model_type=laser_model,
    )
    localizer = Localizer(GridMap(cells, 0.05, (-10.0, -10.0)), settings, Belief(), rng)
    beams = read_beams(rng.uniform(0.5, 8.0, 60), np.linspace(-2.0, 2.0, 60), (0.1, 0.0), 0.1, 10.0)
    steps = itertools.count()

    def step():
        x = 0.01 * (next(steps) % 100 + 1)
        localizer.scan("laser", (x, 0.0, 0.0), beams)

    return step


def window_of_velocities(kind):
    """Return a function that chooses among 20 x 20 velocities, in a local costmap of 60 x 60 cells."""
    grid = CostGrid()
    grid.resize(60, 60, 0.05, -1.5, -1.5)
    grid.costs[45:50], grid.costs[50:] = 120, 254
    settings = DwaSettings(
        min_vel_x=-0.1, max_vel_y=0.0, min_vel_y=0.0, max_vel_theta=1.8, sim_period=0.1,
        vx_samples=20, vy_samples=1, vth_samples=20,
    )  # fmt: skip
    planner = DwaPlanner(settings)
    if kind is TrajectoryPlanner:
        limits = {"max_vel_theta": 1.8, "min_vel_theta": -1.8, "holonomic_robot": False, "sim_period": 0.1}
        planner = TrajectoryPlanner(TrajectorySettings(**limits))
    plan = [(x / 20, 0.3 * np.sin(x / 10)) for x in range(30)]

    def choose():
        planner.look_at(grid, FOOTPRINT, (0.0, 0.0, 0.1), plan)
        planner.choose((0.0, 0.0, 0.1), (0.2, 0.0, 0.1))

    return choose


def mapping_scans(particles):
    """Return the processor times (ms) of processed scans on a drive at 0.4 m/s, and its duration (s)."""
    angles = math.tau / 360 * np.arange(360)
    area = {"xmin": -10.0, "ymin": -10.0, "xmax": 10.0, "ymax": 10.0}
    settings = MappingSettings(**area, particles=particles).with_ranges(10.0)
    slam = GridSlam(settings, angles, (0.0, 0.0, 0.0), np.random.default_rng(1))
    survey, taken, moments = Survey(settings, angles), [], list(drive(rays=360))
    for moment in moments:
        began = time.process_time_ns()
        odometry = moment.odometry.x, moment.odometry.y, moment.odometry.yaw
        if slam.scan(odometry, moment.ranges, moment.time_s):
            survey.follow(slam.steps[slam.best])
            survey.values()
            taken.append((time.process_time_ns() - began) / 1e6)
    return taken, moments[-1].time_s


def inflated_building(size):
    """Return a costmap of a building with walls at 5 cm per cell, and the function that inflates it."""
    numbers = np.random.default_rng(1)
    costs = np.zeros((size, size), np.uint8)
    for _ in range(size // 10):
        x, y = numbers.integers(0, size, 2)
        wide, high = (4, size // 8) if numbers.random() < 0.5 else (size // 8, 4)
        costs[y : y + high, x : x + wide] = LETHAL
    costs[:40, :40] = costs[-40:, -40:] = 0
    costmap = LayeredCostmap()
    costmap.resize(size, size, 0.05, 0.0, 0.0)
    costmap.set_footprint(circle(0.15))
    layer = InflationLayer("inflation", costmap)
    layer.configure(radius=1.0, scaling=3.0, inflate_unknown=False)
    whole = CellRectangle(0, 0, size, size)

    def inflate():
        costmap.grid.costs[...] = costs
        layer.update_costs(whole)

    return costmap.grid, inflate


def local_update():
    """Return a function that adds a scan of 360 rays to a rolling map of 60 x 60 cells, and updates it."""
    costmap = LayeredCostmap(is_rolling=True)
    costmap.resize(60, 60, 0.05, 0.0, 0.0)
    obstacles = ObstacleLayer("obstacles", costmap, lambda: 0, tracks_unknown=False)
    source = ObservationSource(SourceSettings("scan", clearing=True))
    obstacles.sources.append(source)
    layer = InflationLayer("inflation", costmap)
    costmap.layers += [obstacles, layer]
    costmap.set_footprint(circle(0.15))
    layer.configure(radius=1.0, scaling=3.0, inflate_unknown=False)
    numbers = np.random.default_rng(2)
    angles = np.linspace(0, 2 * np.pi, 360)
    x = 0.0

    def step():
        nonlocal x
        x += 0.01
        ranges = numbers.uniform(0.3, 3.0, 360)
        points = np.stack([np.cos(angles) * ranges, np.sin(angles) * ranges, 0 * ranges], axis=1)
        pose = (x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        source.add(points.astype(np.float32), pose, pose, 1, 1, 10_000)
        costmap.update(Pose2D(x, 0.0, 0.0))

    return step


def path_search(size):
    """Return a function that plans from one corner of a building to the other."""
    grid, inflate = inflated_building(size)
    inflate()

    def step():
        assert plan(grid.costs, (20, 20), (size - 20, size - 20))

    return step


OPERATIONS = {
    "EKF, one step with 12 variables": lambda: filter_step(ExtendedKalmanFilter()),
    "UKF, one step with 12 variables": lambda: filter_step(UnscentedKalmanFilter(alpha=1.0)),
    "AMCL, 2,000 particles, 60 beams, likelihood field": lambda: amcl_update("likelihood_field"),
    "AMCL, 2,000 particles, 60 beams, beam model": lambda: amcl_update("beam"),
    "inflation of 2,000 x 2,000 cells": lambda: inflated_building(2000)[1],
    "local update of 60 x 60 cells, 360 rays": local_update,
    "plan on 400 x 400 cells": lambda: path_search(400),
    "plan on 2,000 x 2,000 cells": lambda: path_search(2000),
    "DWA, 20 x 20 velocities": lambda: window_of_velocities(DwaPlanner),
    "TrajectoryPlanner, 20 x 20 velocities": lambda: window_of_velocities(TrajectoryPlanner),
}


def main():
    repetitions = options_of(__doc__, repetitions=500).repetitions
    print("| operation | time |\n| --- | ---: |")
    for name, make in OPERATIONS.items():
        print(f"| {name} | {median_ms(make(), repetitions):.3f} ms |")
    print(
        "\n| slam_gmapping at 0.4 m/s, 360 beams | median per processed scan | longest | share of real time |"
    )
    print("| --- | ---: | ---: | ---: |")
    for particles in (1, 8, 30):
        taken, duration_s = mapping_scans(particles)
        share = sum(taken) / 1000.0 / duration_s
        median = statistics.median(taken)
        print(f"| particles: {particles} | {median:.0f} ms | {max(taken):.0f} ms | {share:.1%} |")


if __name__ == "__main__":
    main()
