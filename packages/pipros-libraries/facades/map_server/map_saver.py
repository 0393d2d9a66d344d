"""`rosrun map_server map_saver`: save the map published on `map` as an image and a YAML file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import atan2
from pathlib import Path
from typing import Any

from nav_msgs.msg import OccupancyGrid

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.replaced_file import overwritten_file
from pipros_libraries.maps.errors import MapError
from pipros_libraries.maps.map_file import description_text, grid_pixels
from pipros_libraries.pictures.pgm import write_pgm

USAGE = """Usage: 
  map_saver -h
  map_saver [--occ <threshold_occupied>] [--free <threshold_free>] [-f <mapname>] [ROS remapping args]"""  # noqa: W291

_THRESHOLDS = {"--occ": ("threshold_occupied", 1), "--free": ("threshold_free", 0)}
"""Name and minimum value of each threshold, keyed by option."""


class WrongArguments(ValueError):
    """The command line is invalid."""


def read_arguments(arguments: Sequence[str]) -> tuple[str, int, int]:
    """Return the map name and the thresholds, in percent, for occupied and free cells.

    Raises:
        WrongArguments: an option is unknown, or a value is missing or out of range.
    """
    name, thresholds, rest = "map", {"--occ": 65, "--free": 25}, list(arguments)
    while rest:
        option = rest.pop(0)
        if option not in ("-f", *thresholds) or not rest:
            raise WrongArguments(USAGE)
        value = rest.pop(0)
        if option == "-f":
            name = value
            continue
        thresholds[option] = _threshold(option, value)
    if thresholds["--occ"] <= thresholds["--free"]:
        raise WrongArguments("threshold_free must be smaller than threshold_occupied")
    return name, thresholds["--occ"], thresholds["--free"]


def _threshold(option: str, value: str) -> int:
    what, lowest = _THRESHOLDS[option]
    if not (value.isdecimal() and lowest <= int(value) <= 100):
        raise WrongArguments(f"{what} must be between {lowest} and 100, got {value}")
    return int(value)


def save_map(message: Any, name: str, occupied: int, free: int) -> None:
    """Write `name`.pgm and `name`.yaml. Cells 0 to `free` are free, and cells >= `occupied` are occupied.

    Raises:
        MapError: the number of cells is not width times height. Nothing is written.
        OSError: a file cannot be written. Files of these names stay as they were.
    """
    info = message.info
    rospy.loginfo("Received a %d X %d map @ %.3f m/pix", info.width, info.height, info.resolution)
    if len(message.data) != info.width * info.height:
        raise MapError(f"the map must have {info.width} X {info.height} cells, got {len(message.data)}")
    rospy.loginfo("Writing map occupancy data to %s.pgm", name)
    pixels = grid_pixels(info.width, message.data, free, occupied)
    pgm = write_pgm(info.width, info.height, pixels, f"CREATOR: map_saver.cpp {info.resolution:.3f} m/pix")
    position, q = info.origin.position, info.origin.orientation
    yaw = atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    text = description_text(f"{name}.pgm", info.resolution, (position.x, position.y, yaw))
    with overwritten_file(Path(f"{name}.yaml")) as described:
        described.write(text.encode())
        described.flush()  # so that it has its room before the image is replaced
        with overwritten_file(Path(f"{name}.pgm")) as image:
            image.write(pgm)
        rospy.loginfo("Writing map occupancy data to %s.yaml", name)


@exits_after_ctrl_c(1)
def main() -> int:
    """Wait indefinitely for a map, and save it. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if arguments[:1] == ["-h"]:
        print(USAGE)
        return 0
    try:
        name, occupied, free = read_arguments(arguments)
    except WrongArguments as error:
        print(error)
        return 1
    rospy.init_node("map_saver")
    rospy.loginfo("Waiting for the map")
    try:
        save_map(rospy.wait_for_message("map", OccupancyGrid), name, occupied, free)
    except rospy.ROSInterruptException:
        return 1
    except MapError as error:
        rospy.logerr("Couldn't save the map: %s", error)
        return 1
    except OSError as error:
        rospy.logerr("Couldn't save map file to %s: %s", error.filename, error.strerror)
        return 1
    rospy.loginfo("Done")
    return 0


if __name__ == "__main__":
    sys.exit(main())
