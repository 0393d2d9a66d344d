"""Messages of tf2_web_republisher, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import actionlib_msgs.msg
import geometry_msgs.msg
import std_msgs.msg

class TFArray(_base.Message):
    """Transforms of several frames."""
    transforms: list[geometry_msgs.msg.TransformStamped]
    """those that have changed"""
    def __init__(self, transforms: list[geometry_msgs.msg.TransformStamped] | None = ...) -> None: ...

class TFSubscriptionAction(_base.Message):
    action_goal: TFSubscriptionActionGoal
    action_result: TFSubscriptionActionResult
    action_feedback: TFSubscriptionActionFeedback
    def __init__(self, action_goal: TFSubscriptionActionGoal | None = ..., action_result: TFSubscriptionActionResult | None = ..., action_feedback: TFSubscriptionActionFeedback | None = ...) -> None: ...

class TFSubscriptionActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: TFSubscriptionFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: TFSubscriptionFeedback | None = ...) -> None: ...

class TFSubscriptionActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: TFSubscriptionGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: TFSubscriptionGoal | None = ...) -> None: ...

class TFSubscriptionActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: TFSubscriptionResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: TFSubscriptionResult | None = ...) -> None: ...

class TFSubscriptionFeedback(_base.Message):
    transforms: list[geometry_msgs.msg.TransformStamped]
    """those that have changed"""
    def __init__(self, transforms: list[geometry_msgs.msg.TransformStamped] | None = ...) -> None: ...

class TFSubscriptionGoal(_base.Message):
    """Sends the transforms of some frames as feedback, when they have changed enough."""
    source_frames: list[str]
    """frames whose transforms are wanted"""
    target_frame: str
    """frame in which they are given"""
    angular_thres: float
    """send a transform after a turn by twice this angle, in radians"""
    trans_thres: float
    """or a movement by this distance, in metres"""
    rate: float
    """maximum rate of checks, in Hz"""
    def __init__(self, source_frames: list[str] | None = ..., target_frame: str | None = ..., angular_thres: float | None = ..., trans_thres: float | None = ..., rate: float | None = ...) -> None: ...

class TFSubscriptionResult(_base.Message):
    def __init__(self) -> None: ...
