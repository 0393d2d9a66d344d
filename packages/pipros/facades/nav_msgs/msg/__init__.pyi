"""Messages of nav_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time
import actionlib_msgs.msg
import geometry_msgs.msg
import std_msgs.msg

class GetMapAction(_base.Message):
    action_goal: GetMapActionGoal
    action_result: GetMapActionResult
    action_feedback: GetMapActionFeedback
    def __init__(self, action_goal: GetMapActionGoal | None = ..., action_result: GetMapActionResult | None = ..., action_feedback: GetMapActionFeedback | None = ...) -> None: ...

class GetMapActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: GetMapFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: GetMapFeedback | None = ...) -> None: ...

class GetMapActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: GetMapGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: GetMapGoal | None = ...) -> None: ...

class GetMapActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: GetMapResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: GetMapResult | None = ...) -> None: ...

class GetMapFeedback(_base.Message):
    def __init__(self) -> None: ...

class GetMapGoal(_base.Message):
    """Requests the map, like the service GetMap, for clients that prefer an action. The goal is empty."""
    def __init__(self) -> None: ...

class GetMapResult(_base.Message):
    map: OccupancyGrid
    """the current map"""
    def __init__(self, map: OccupancyGrid | None = ...) -> None: ...

class GridCells(_base.Message):
    """Cells of a grid, such as obstacles or frontiers, which rviz can draw."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the cells"""
    cell_width: float
    """extent of a cell along x, metres"""
    cell_height: float
    """extent of a cell along y, metres"""
    cells: list[geometry_msgs.msg.Point]
    """the centre of each cell, metres"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., cell_width: float | None = ..., cell_height: float | None = ..., cells: list[geometry_msgs.msg.Point] | None = ...) -> None: ...

class MapMetaData(_base.Message):
    """Size and position of an occupancy grid. The map server also publishes it separately, on map_metadata."""
    map_load_time: _time.Time
    """when the map was loaded or created"""
    resolution: float
    """side length of a cell, metres"""
    width: int
    """cells along x"""
    height: int
    """cells along y"""
    origin: geometry_msgs.msg.Pose
    """pose of the outer corner of cell (0, 0) in the frame of the map; metres"""
    def __init__(self, map_load_time: _time.Time | None = ..., resolution: float | None = ..., width: int | None = ..., height: int | None = ..., origin: geometry_msgs.msg.Pose | None = ...) -> None: ...

class OccupancyGrid(_base.Message):
    """A map of square cells on the ground. A map server or SLAM publishes it latched on map; costmaps
    publish it, too. Cell (x, y) is data[y * info.width + x]; x and y increase along the axes of info.origin."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the map, usually map (REP 105)"""
    info: MapMetaData
    """resolution, size and origin"""
    @property
    def data(self) -> _Sequence[int]:
        """from 0 (free) to 100 (occupied); -1: unknown"""
    @data.setter
    def data(self, value: _types.Array[int]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., info: MapMetaData | None = ..., data: _types.Array[int] | None = ...) -> None: ...

class Odometry(_base.Message):
    """Estimated pose and velocity of a robot, from wheels, an IMU or cameras; usually on odom. The pose drifts,
    but never jumps (REP 105)."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the pose, usually odom"""
    child_frame_id: str
    """the frame of the body and of the velocity, usually base_link"""
    pose: geometry_msgs.msg.PoseWithCovariance
    """pose of child_frame_id in header.frame_id"""
    twist: geometry_msgs.msg.TwistWithCovariance
    """velocity along the axes of child_frame_id: linear.x is forward speed"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., child_frame_id: str | None = ..., pose: geometry_msgs.msg.PoseWithCovariance | None = ..., twist: geometry_msgs.msg.TwistWithCovariance | None = ...) -> None: ...

class Path(_base.Message):
    """A path, as published by planners."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the path; stamp: when it was planned"""
    poses: list[geometry_msgs.msg.PoseStamped]
    """from the first to the last; use the header above, because their own headers may be empty"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., poses: list[geometry_msgs.msg.PoseStamped] | None = ...) -> None: ...
