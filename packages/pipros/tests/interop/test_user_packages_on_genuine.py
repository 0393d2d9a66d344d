"""The realistic packages of tests.graph, with half of their nodes on genuine ROS."""

import os

import pytest

from tests.support import errand
from tests.support.patrol import PACKAGES, SAID
from tests.support.processes import Process
from tests.support.ros import RosSystem, Side

PAIRS = [("pipros", "genuine"), ("genuine", "pipros"), ("genuine", "genuine")]


@pytest.mark.parametrize(("base", "patrol"), PAIRS)
def test_a_robot_with_actions_and_transforms_patrols(plain_ros: RosSystem, base: str, patrol: str) -> None:
    sides = with_packages(plain_ros)
    plain_ros.serve_master()

    sides[base].start("rosrun", "patrol", "base.py")
    ended = sides[patrol].run("rosrun", "patrol", "patrol.py", timeout_s=120)

    assert ended.stdout == SAID, ended.output


@pytest.mark.parametrize(("world", "machine"), PAIRS)
def test_a_state_machine_runs_an_errand(plain_ros: RosSystem, world: str, machine: str) -> None:
    sides = with_packages(plain_ros)
    # Genuine ROS finds Python code in built packages only.
    sides["genuine"].environment["PYTHONPATH"] = str(errand.SOURCES)
    plain_ros.serve_master()

    attempts = 4 if machine == "genuine" else 1
    ended = run_errand(sides, world, machine, 120 if attempts == 1 else 40)
    while ended is None and (attempts := attempts - 1):
        ended = run_errand(sides, world, machine, 40)
    assert ended is not None

    assert [line for line in ended.stdout if line in errand.SAID] == errand.SAID, ended.output


def run_errand(sides: dict[str, Side], world: str, machine: str, timeout_s: float) -> Process | None:
    """Return the program after its end, or None if it did not end.

    On a busy machine, genuine actionlib loses results that arrive before it tracks the goal, and waits for
    ever: "Got a transition callback on a goal handle that we're not tracking".
    """
    served = sides[world].start("rosrun", "state_machines", "world.py")
    errand_process = sides[machine].start("rosrun", "state_machines", "errand.py")
    try:
        errand_process.wait(timeout_s)
    except AssertionError:
        errand_process.end()
        served.end()
        return None
    return errand_process


def with_packages(ros: RosSystem) -> dict[str, Side]:
    """Return both sides by name, with the packages on their paths."""
    sides = {"pipros": ros.pipros, "genuine": ros.genuine}
    for side in sides.values():
        paths = (str(PACKAGES), side.environment["ROS_PACKAGE_PATH"])
        side.environment["ROS_PACKAGE_PATH"] = os.pathsep.join(paths)
    return sides
