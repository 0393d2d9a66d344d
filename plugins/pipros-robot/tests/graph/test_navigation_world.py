"""A simulated robot with amcl and move_base in lockstep: `navigation_world`, and drives in the apartment."""

from __future__ import annotations

import logging
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

import numpy as np
import pytest

from pipros_robot.navigation.world import NavigationWorld, WorldFailure
from pipros_workspace.index import SHARED_PACKAGES
from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START = (2.9, 1.0, 1.2)
KITCHEN, BEDROOM, STUDY = (7.8, 1.5, 0.0), (2.5, 5.8, 1.5), (7.4, 5.9, -0.8)


@contextmanager
def world(ros: RosSystem, **options: Any) -> Iterator[NavigationWorld]:
    log = logging.getLogger("navigation_world")
    log.setLevel(logging.ERROR)
    try:
        with closing(NavigationWorld(ros.master_uri, APARTMENT, start=START, **options)) as made:
            yield made
    finally:
        log.setLevel(logging.NOTSET)  # of other tests of this process, too


@pytest.mark.parametrize("seed", range(10))
def test_every_seed_reaches_its_goal_without_touching_a_wall(ros: RosSystem, seed: int) -> None:
    ros.serve_master()
    with world(ros, seed=seed) as apartment, apartment.never_closer_than(0.01):
        apartment.reaches(*(KITCHEN, BEDROOM, STUDY)[seed % 3], within_s=90)
    errors_m, errors_rad = np.array(apartment.errors).T
    assert np.percentile(errors_m, 95) < 0.1
    assert np.percentile(errors_rad, 95) < np.radians(3)


def test_the_same_seed_gives_the_same_drive_twice(ros: RosSystem) -> None:
    ros.serve_master()
    ends = []
    for _ in range(2):
        with world(ros, seed=11) as apartment:
            apartment.send_goal(*BEDROOM)
            apartment.run_for(6.0)
            ends.append((apartment.pose, apartment.estimate, apartment.errors))
    assert ends[0] == ends[1]
    assert ends[0][0] != START


def test_failures_say_what_happened(ros: RosSystem) -> None:
    ros.serve_master()
    patience = {"move_base": {"planner_patience": 0.5, "recovery_behavior_enabled": False}}
    with world(ros, parameters=patience) as apartment:
        with pytest.raises(WorldFailure, match=r"aborted after .* s: Failed to find a valid plan"):
            apartment.reaches(4.05, 0.6, 0.0, within_s=30)  # in a wall
        with pytest.raises(WorldFailure, match=r"was not reached within 1 s: the robot is at \(\d\.\d+,"):
            apartment.reaches(*KITCHEN, within_s=1)
        came_near = pytest.raises(WorldFailure, match=r"obstacles must be at least 9 m, got 0\.\d+ m")
        with came_near, apartment.never_closer_than(9.0):
            apartment.run_for(0.5)
        with pytest.raises(WorldFailure, match=r"the localisation is wrong by \d\.\d+ m, 1 s after"):
            apartment.recovers_from_kidnapping(*KITCHEN, within_s=1)


def test_the_tests_of_the_example_package_pass_in_a_project_of_their_own() -> None:
    folder = REPOSITORY / "examples" / "navigation_tests"
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", "--rootdir", str(folder), str(folder)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert "3 passed" in ended.stdout, ended.stdout
