"""Messages of map_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import nav_msgs.msg
import sensor_msgs.msg
import std_msgs.msg

class OccupancyGridUpdate(_base.Message):
    """Changes a rectangle of an occupancy grid that was sent earlier. Costmaps publish it on TOPIC_updates, and
    the whole grid on TOPIC."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the grid"""
    x: int
    """first column of the rectangle, cells"""
    y: int
    """first row of the rectangle, cells"""
    width: int
    """columns of the rectangle, cells"""
    height: int
    """rows of the rectangle, cells"""
    @property
    def data(self) -> _Sequence[int]:
        """the new values, row by row, as in OccupancyGrid"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., x: int | None = ..., y: int | None = ..., width: int | None = ..., height: int | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class PointCloud2Update(_base.Message):
    """Changes a map of points that was sent earlier."""
    ADD: _Final = 0
    """add these points"""
    DELETE: _Final = 1
    """remove these points"""
    header: std_msgs.msg.Header
    """frame_id: the frame of the map; stamp: when it changed"""
    type: int
    """ADD or DELETE"""
    points: sensor_msgs.msg.PointCloud2
    """the points to add or remove"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., type: int | None = ..., points: sensor_msgs.msg.PointCloud2 | None = ...) -> None: ...

class ProjectedMap(_base.Message):
    """A slice of a 3D map, seen from above as an occupancy grid."""
    map: nav_msgs.msg.OccupancyGrid
    """the grid"""
    min_z: float
    """lower end of the slice, metres"""
    max_z: float
    """upper end of the slice, metres"""
    def __init__(self, map: nav_msgs.msg.OccupancyGrid | None = ..., min_z: float | None = ..., max_z: float | None = ...) -> None: ...

class ProjectedMapInfo(_base.Message):
    """The box of a 3D map that is projected onto a grid."""
    frame_id: str
    """the frame of the numbers below"""
    x: float
    """position of the box along x, metres"""
    y: float
    """position of the box along y, metres"""
    width: float
    """extent along x, metres"""
    height: float
    """extent along y, metres"""
    min_z: float
    """lower end, metres"""
    max_z: float
    """upper end, metres"""
    def __init__(self, frame_id: str | None = ..., x: float | None = ..., y: float | None = ..., width: float | None = ..., height: float | None = ..., min_z: float | None = ..., max_z: float | None = ...) -> None: ...
