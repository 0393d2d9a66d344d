"""Services of map_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import map_msgs.msg
import nav_msgs.msg
import sensor_msgs.msg
import std_msgs.msg

class GetMapROIRequest(_base.Message):
    """Returns a rectangle of an occupancy grid."""
    x: float
    """position of the rectangle along x in the frame of the map, usually its centre, metres"""
    y: float
    """position of the rectangle along y, metres"""
    l_x: float
    """extent along x, metres"""
    l_y: float
    """extent along y, metres"""
    def __init__(self, x: float | None = ..., y: float | None = ..., l_x: float | None = ..., l_y: float | None = ...) -> None: ...

class GetMapROIResponse(_base.Message):
    sub_map: nav_msgs.msg.OccupancyGrid
    """the rectangle, with its own origin"""
    def __init__(self, sub_map: nav_msgs.msg.OccupancyGrid | None = ...) -> None: ...

class GetPointMapRequest(_base.Message):
    """Returns a whole map of points. The request is empty."""
    def __init__(self) -> None: ...

class GetPointMapResponse(_base.Message):
    map: sensor_msgs.msg.PointCloud2
    """the map"""
    def __init__(self, map: sensor_msgs.msg.PointCloud2 | None = ...) -> None: ...

class GetPointMapROIRequest(_base.Message):
    """Returns the part of a map of points that is in a sphere, a box, or both."""
    x: float
    """position of the part along x in the frame of the map, usually its centre, metres"""
    y: float
    """position of the part along y, metres"""
    z: float
    """position of the part along z, metres"""
    r: float
    """radius of the sphere, metres; 0: no sphere"""
    l_x: float
    """extent of the box along x, metres; 0: no bound"""
    l_y: float
    """extent of the box along y, metres; 0: no bound"""
    l_z: float
    """extent of the box along z, metres; 0: no bound"""
    def __init__(self, x: float | None = ..., y: float | None = ..., z: float | None = ..., r: float | None = ..., l_x: float | None = ..., l_y: float | None = ..., l_z: float | None = ...) -> None: ...

class GetPointMapROIResponse(_base.Message):
    sub_map: sensor_msgs.msg.PointCloud2
    """the points in it"""
    def __init__(self, sub_map: sensor_msgs.msg.PointCloud2 | None = ...) -> None: ...

class ProjectedMapsInfoRequest(_base.Message):
    """Sets the boxes of a 3D map that are projected. The response is empty."""
    projected_maps_info: list[map_msgs.msg.ProjectedMapInfo]
    """one for each projected map"""
    def __init__(self, projected_maps_info: list[map_msgs.msg.ProjectedMapInfo] | None = ...) -> None: ...

class ProjectedMapsInfoResponse(_base.Message):
    def __init__(self) -> None: ...

class SaveMapRequest(_base.Message):
    """Writes the map of a map server to a file. The response is empty."""
    filename: std_msgs.msg.String
    """path on the server's machine"""
    def __init__(self, filename: std_msgs.msg.String | None = ...) -> None: ...

class SaveMapResponse(_base.Message):
    def __init__(self) -> None: ...

class SetMapProjectionsRequest(_base.Message):
    """Sets up the projected maps of a 3D map, and returns their list. The request is empty."""
    def __init__(self) -> None: ...

class SetMapProjectionsResponse(_base.Message):
    projected_maps_info: list[map_msgs.msg.ProjectedMapInfo]
    """one for each projected map"""
    def __init__(self, projected_maps_info: list[map_msgs.msg.ProjectedMapInfo] | None = ...) -> None: ...

class GetMapROI:
    """Returns a rectangle of an occupancy grid."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetMapROIRequest]]
    _response_class: _ClassVar[type[GetMapROIResponse]]

class GetPointMap:
    """Returns a whole map of points. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetPointMapRequest]]
    _response_class: _ClassVar[type[GetPointMapResponse]]

class GetPointMapROI:
    """Returns the part of a map of points that is in a sphere, a box, or both."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetPointMapROIRequest]]
    _response_class: _ClassVar[type[GetPointMapROIResponse]]

class ProjectedMapsInfo:
    """Sets the boxes of a 3D map that are projected. The response is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ProjectedMapsInfoRequest]]
    _response_class: _ClassVar[type[ProjectedMapsInfoResponse]]

class SaveMap:
    """Writes the map of a map server to a file. The response is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SaveMapRequest]]
    _response_class: _ClassVar[type[SaveMapResponse]]

class SetMapProjections:
    """Sets up the projected maps of a 3D map, and returns their list. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetMapProjectionsRequest]]
    _response_class: _ClassVar[type[SetMapProjectionsResponse]]
