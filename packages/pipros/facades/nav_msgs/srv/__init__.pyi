"""Services of nav_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from typing import Final as _Final
from pipros.msg import base as _base
import geometry_msgs.msg
import nav_msgs.msg

class GetMapRequest(_base.Message):
    """Returns the map; the map server offers it as static_map. The request is empty."""
    def __init__(self) -> None: ...

class GetMapResponse(_base.Message):
    map: nav_msgs.msg.OccupancyGrid
    """the current map"""
    def __init__(self, map: nav_msgs.msg.OccupancyGrid | None = ...) -> None: ...

class GetPlanRequest(_base.Message):
    """Plans a path without driving it; move_base offers it as make_plan."""
    start: geometry_msgs.msg.PoseStamped
    """where to begin"""
    goal: geometry_msgs.msg.PoseStamped
    """where to end"""
    tolerance: float
    """how far from a blocked goal the path may end, metres"""
    def __init__(self, start: geometry_msgs.msg.PoseStamped | None = ..., goal: geometry_msgs.msg.PoseStamped | None = ..., tolerance: float | None = ...) -> None: ...

class GetPlanResponse(_base.Message):
    plan: nav_msgs.msg.Path
    """the path; it has no poses if none was found"""
    def __init__(self, plan: nav_msgs.msg.Path | None = ...) -> None: ...

class LoadMapRequest(_base.Message):
    """Loads another map; the map server offers it as change_map."""
    map_url: str
    """path or URL of the map's YAML file"""
    def __init__(self, map_url: str | None = ...) -> None: ...

class LoadMapResponse(_base.Message):
    RESULT_SUCCESS: _Final = 0
    """the map is loaded"""
    RESULT_MAP_DOES_NOT_EXIST: _Final = 1
    """the file does not exist"""
    RESULT_INVALID_MAP_DATA: _Final = 2
    """the image cannot be read"""
    RESULT_INVALID_MAP_METADATA: _Final = 3
    """the YAML file cannot be read"""
    RESULT_UNDEFINED_FAILURE: _Final = 255
    """any other failure"""
    map: nav_msgs.msg.OccupancyGrid
    """the new map; map_server leaves it empty"""
    result: int
    """one of RESULT_...; map_server sends RESULT_UNDEFINED_FAILURE for all failures"""
    def __init__(self, map: nav_msgs.msg.OccupancyGrid | None = ..., result: int | None = ...) -> None: ...

class SetMapRequest(_base.Message):
    """Sets the map and the initial pose for localization; amcl offers it as set_map."""
    map: nav_msgs.msg.OccupancyGrid
    """the new map"""
    initial_pose: geometry_msgs.msg.PoseWithCovarianceStamped
    """first estimate of the robot's pose in it"""
    def __init__(self, map: nav_msgs.msg.OccupancyGrid | None = ..., initial_pose: geometry_msgs.msg.PoseWithCovarianceStamped | None = ...) -> None: ...

class SetMapResponse(_base.Message):
    success: bool
    """true if the map and the pose were accepted"""
    def __init__(self, success: bool | None = ...) -> None: ...

class GetMap:
    """Returns the map; the map server offers it as static_map. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetMapRequest]]
    _response_class: _ClassVar[type[GetMapResponse]]

class GetPlan:
    """Plans a path without driving it; move_base offers it as make_plan."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetPlanRequest]]
    _response_class: _ClassVar[type[GetPlanResponse]]

class LoadMap:
    """Loads another map; the map server offers it as change_map."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[LoadMapRequest]]
    _response_class: _ClassVar[type[LoadMapResponse]]

class SetMap:
    """Sets the map and the initial pose for localization; amcl offers it as set_map."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetMapRequest]]
    _response_class: _ClassVar[type[SetMapResponse]]
