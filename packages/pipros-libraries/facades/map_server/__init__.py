"""`rosrun map_server map_server map.yaml`: publish a map. To save a map, use `map_saver`."""

from __future__ import annotations

import os
import sys
from array import array
from math import cos, sin
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, LoadMap, LoadMapResponse
from std_msgs.msg import Header

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.maps.errors import BadMapDescription, MapError
from pipros_libraries.maps.map_file import Grid, MapDescription, make_grid, read_map
from pipros_libraries.maps.picture import read_picture

USAGE = """
USAGE: map_server <map.yaml>
  map.yaml: map description file
DEPRECATED USAGE: map_server <map> <resolution>
  map: image file to load
  resolution: map resolution [meters/pixel]"""


def message_of(grid: Grid, frame_id: str) -> Any:
    """Return a map as an OccupancyGrid, stamped with the current time.

    As in Noetic, the orientation is computed in 32-bit floating point.
    """
    now = rospy.Time.now()
    x, y, yaw = grid.description.origin
    half = array("f", [yaw])[0] / 2
    z, w = array("f", [sin(half), cos(half)])
    origin = Pose(Point(x, y, 0.0), Quaternion(0.0, 0.0, z, w))
    info = MapMetaData(now, grid.description.resolution, grid.width, grid.height, origin)
    return OccupancyGrid(Header(stamp=now, frame_id=frame_id), info, grid.cells)


class MapServer:
    """Server of a map: the latched topics `map` and `map_metadata`, and the service `static_map`.

    The service `change_map` loads another map from a YAML file. As in Noetic, its response has no map, and
    its result is 0 or 255.
    """

    def __init__(self, grid: Grid, frame_id: str = "map") -> None:
        self._frame_id = frame_id
        self._map_topic = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._metadata_topic = rospy.Publisher("map_metadata", MapMetaData, queue_size=1, latch=True)
        self._publish(grid)
        rospy.Service("static_map", GetMap, self._on_get)
        rospy.Service("change_map", LoadMap, self._on_change)

    def _publish(self, grid: Grid) -> None:
        rospy.loginfo(
            "Read a %d X %d map @ %.3f m/cell", grid.width, grid.height, grid.description.resolution
        )
        self._map = message_of(grid, self._frame_id)
        self._metadata_topic.publish(self._map.info)
        self._map_topic.publish(self._map)

    def _on_get(self, _request: Any) -> Any:
        rospy.loginfo("Sending map")
        return GetMapResponse(self._map)

    def _on_change(self, request: Any) -> Any:
        try:
            grid = read_map(request.map_url)
        except MapError as error:
            rospy.logerr("%s", error)
            return LoadMapResponse(result=LoadMapResponse.RESULT_UNDEFINED_FAILURE)
        self._publish(grid)
        return LoadMapResponse(result=LoadMapResponse.RESULT_SUCCESS)


@exits_after_ctrl_c()
def main() -> int:
    """Serve the map until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) not in (1, 2):
        print(USAGE, file=sys.stderr)
        return 255
    rospy.init_node("map_server", anonymous=True)
    try:
        if len(arguments) == 2:
            rospy.logwarn("map_server <map> <resolution> is deprecated: pass only the YAML file of the map.")
            grid = make_grid(_old_description(*arguments), read_picture(arguments[0]))
        else:
            rospy.loginfo('Loading map from image "%s"', arguments[0])
            grid = read_map(os.path.abspath(arguments[0]))
    except MapError as error:
        rospy.logerr("%s", error)
        return 255
    rospy.sleep(0)  # wait for simulated time
    MapServer(grid, str(rospy.get_param("~frame_id", "map")))
    rospy.spin()
    return 0


def _old_description(image: str, text: str) -> MapDescription:
    """Return the map description for the deprecated command line `map_server <map> <resolution>`.

    The thresholds and `negate` come from private parameters.
    """
    try:
        resolution = float(text)
    except ValueError:
        resolution = 0.0
    if not 0.0 < resolution < float("inf"):
        raise BadMapDescription(f"resolution must be a finite number > 0 (m/pixel), got {text}")
    values = {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    for name, default in values.items():
        given = rospy.get_param(f"~{name}", default)
        values[name] = given if isinstance(given, int | float) else default
    return MapDescription(
        image,
        resolution,
        negate=bool(values["negate"]),
        occupied=values["occupied_thresh"],
        free=values["free_thresh"],
    )
