"""Messages of tf2_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import time as _time
import actionlib_msgs.msg
import geometry_msgs.msg
import std_msgs.msg

class LookupTransformAction(_base.Message):
    action_goal: LookupTransformActionGoal
    action_result: LookupTransformActionResult
    action_feedback: LookupTransformActionFeedback
    def __init__(self, action_goal: LookupTransformActionGoal | None = ..., action_result: LookupTransformActionResult | None = ..., action_feedback: LookupTransformActionFeedback | None = ...) -> None: ...

class LookupTransformActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: LookupTransformFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: LookupTransformFeedback | None = ...) -> None: ...

class LookupTransformActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: LookupTransformGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: LookupTransformGoal | None = ...) -> None: ...

class LookupTransformActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: LookupTransformResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: LookupTransformResult | None = ...) -> None: ...

class LookupTransformFeedback(_base.Message):
    def __init__(self) -> None: ...

class LookupTransformGoal(_base.Message):
    """Asks a tf2_ros buffer server for a transform, for clients without their own buffer."""
    target_frame: str
    """the frame to which data is transformed"""
    source_frame: str
    """the frame of the data"""
    source_time: _time.Time
    """the time of the transform; 0: the latest"""
    timeout: _time.Duration
    """how long to wait for the transform"""
    target_time: _time.Time
    """if advanced is true: the time of target_frame"""
    fixed_frame: str
    """if advanced is true: a frame that does not move between source_time and target_time"""
    advanced: bool
    """whether to transform from source_time to target_time, through fixed_frame"""
    def __init__(self, target_frame: str | None = ..., source_frame: str | None = ..., source_time: _time.Time | None = ..., timeout: _time.Duration | None = ..., target_time: _time.Time | None = ..., fixed_frame: str | None = ..., advanced: bool | None = ...) -> None: ...

class LookupTransformResult(_base.Message):
    transform: geometry_msgs.msg.TransformStamped
    """converts coordinates in source_frame to target_frame"""
    error: TF2Error
    """the reason if there is no transform; otherwise NO_ERROR"""
    def __init__(self, transform: geometry_msgs.msg.TransformStamped | None = ..., error: TF2Error | None = ...) -> None: ...

class TF2Error(_base.Message):
    """Why a transform could not be looked up."""
    NO_ERROR: _Final = 0
    """the transform was found"""
    LOOKUP_ERROR: _Final = 1
    """a frame does not exist"""
    CONNECTIVITY_ERROR: _Final = 2
    """the frames are not in one tree"""
    EXTRAPOLATION_ERROR: _Final = 3
    """no data for that time, which is too early or too late"""
    INVALID_ARGUMENT_ERROR: _Final = 4
    """an invalid argument, such as an empty frame name"""
    TIMEOUT_ERROR: _Final = 5
    """the transform did not arrive in time"""
    TRANSFORM_ERROR: _Final = 6
    """any other failure"""
    error: int
    """one of the constants above"""
    error_string: str
    """human-readable: what is missing"""
    def __init__(self, error: int | None = ..., error_string: str | None = ...) -> None: ...

class TFMessage(_base.Message):
    """Transforms for all tf2 listeners. Those that change are published repeatedly on /tf; those that never change
    are latched on /tf_static."""
    transforms: list[geometry_msgs.msg.TransformStamped]
    """any number"""
    def __init__(self, transforms: list[geometry_msgs.msg.TransformStamped] | None = ...) -> None: ...
