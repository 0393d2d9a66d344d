"""Messages of move_base_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import actionlib_msgs.msg
import geometry_msgs.msg
import std_msgs.msg

class MoveBaseAction(_base.Message):
    action_goal: MoveBaseActionGoal
    action_result: MoveBaseActionResult
    action_feedback: MoveBaseActionFeedback
    def __init__(self, action_goal: MoveBaseActionGoal | None = ..., action_result: MoveBaseActionResult | None = ..., action_feedback: MoveBaseActionFeedback | None = ...) -> None: ...

class MoveBaseActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: MoveBaseFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: MoveBaseFeedback | None = ...) -> None: ...

class MoveBaseActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: MoveBaseGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: MoveBaseGoal | None = ...) -> None: ...

class MoveBaseActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: MoveBaseResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: MoveBaseResult | None = ...) -> None: ...

class MoveBaseFeedback(_base.Message):
    base_position: geometry_msgs.msg.PoseStamped
    """current pose of the robot, in the frame of the global costmap (map)"""
    def __init__(self, base_position: geometry_msgs.msg.PoseStamped | None = ...) -> None: ...

class MoveBaseGoal(_base.Message):
    """Drives a robot to a pose, around obstacles; move_base serves it. The result is empty: its status indicates
    how the goal ended."""
    target_pose: geometry_msgs.msg.PoseStamped
    """the pose to reach, usually in the frame map"""
    def __init__(self, target_pose: geometry_msgs.msg.PoseStamped | None = ...) -> None: ...

class MoveBaseResult(_base.Message):
    def __init__(self) -> None: ...

class RecoveryStatus(_base.Message):
    """The recovery behaviour that move_base begins when it is stuck; on move_base/recovery_status."""
    pose_stamped: geometry_msgs.msg.PoseStamped
    """pose of the robot"""
    current_recovery_number: int
    """index of the behaviour in the list, counted from 0"""
    total_number_of_recoveries: int
    """length of the list"""
    recovery_behavior_name: str
    """name of the behaviour, as configured"""
    def __init__(self, pose_stamped: geometry_msgs.msg.PoseStamped | None = ..., current_recovery_number: int | None = ..., total_number_of_recoveries: int | None = ..., recovery_behavior_name: str | None = ...) -> None: ...
