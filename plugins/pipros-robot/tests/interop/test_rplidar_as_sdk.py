"""Turns of a simulated RPLIDAR, read by the driver and by the vendor's own library (`pyrplidarsdk`)."""

import importlib.util
import json
import sys
from contextlib import closing
from pathlib import Path

import pytest

from pipros_robot.perception.drivers.rplidar.lidar import Lidar
from pipros_robot.perception.drivers.rplidar.samples import Point
from pipros_robot.perception.drivers.rplidar.turns import TurnCollector
from pipros_robot.perception.drivers.streams import serial_port
from tests.support.environments import file_of_tests
from tests.support.genuine import is_required
from tests.support.processes import Processes
from tests.support.simulated_rplidar import MODES, SimulatedRplidar

PROGRAM = file_of_tests("interop/programs/sdk_turns.py")
TURNS = 4


def room(angle: float) -> float:
    """Distances up to 27 m, for all scales of a format, and none at 100 to 110 degrees."""
    return 0 if 100 < angle < 110 else 60 + 75 * angle


def small_room(angle: float) -> float:
    """Distances up to 11 m."""
    return 0.4 * room(angle)


def own_turn(path: Path) -> list[Point]:
    with closing(serial_port(str(path), 115200).open()) as stream:
        lidar, turns, found = Lidar(stream, "lidar", lambda: False), TurnCollector(), []
        modes, typical = lidar.modes()
        decoder = lidar.start(next(mode for mode in modes if mode.number == typical))
        while len(found) < TURNS:
            found += [turn for segment in decoder.feed(lidar.read()) if (turn := turns.add(segment))]
        lidar.stop()
    return found[-1]


@pytest.mark.parametrize("mode", MODES, ids=lambda number: MODES[number][0])
def test_a_turn_is_that_of_the_vendors_library(processes: Processes, tmp_path: Path, mode: int) -> None:
    if importlib.util.find_spec("pyrplidarsdk") is None:
        (pytest.fail if is_required() else pytest.skip)("pip install pyrplidarsdk")
    scene = small_room if MODES[mode][0] in ("Standard", "Express") else room
    device = SimulatedRplidar(tmp_path / "tty", scene, typical=mode, samples=960)
    try:
        ended = processes.run(sys.executable, PROGRAM, device.path, str(TURNS), tmp_path / "turns")
        assert ended.returncode == 0, ended.output
        theirs = json.loads((tmp_path / "turns").read_text())[-1]
        ours = [each for each in own_turn(device.path) if each.distance_mm]
    finally:
        device.unplug()
    assert len(ours) == len(theirs) > 900
    for point, (angle, distance_mm, quality) in zip(ours, theirs, strict=True):
        assert point.distance_mm == pytest.approx(distance_mm, abs=0.26)
        assert abs((point.angle - angle + 180) % 360 - 180) < 0.03
        assert point.quality == quality >> 2
