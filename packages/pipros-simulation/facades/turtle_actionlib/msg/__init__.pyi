"""Messages of turtle_actionlib, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import actionlib_msgs.msg
import std_msgs.msg

class ShapeAction(_base.Message):
    action_goal: ShapeActionGoal
    action_result: ShapeActionResult
    action_feedback: ShapeActionFeedback
    def __init__(self, action_goal: ShapeActionGoal | None = ..., action_result: ShapeActionResult | None = ..., action_feedback: ShapeActionFeedback | None = ...) -> None: ...

class ShapeActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: ShapeFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: ShapeFeedback | None = ...) -> None: ...

class ShapeActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: ShapeGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: ShapeGoal | None = ...) -> None: ...

class ShapeActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: ShapeResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: ShapeResult | None = ...) -> None: ...

class ShapeFeedback(_base.Message):
    def __init__(self) -> None: ...

class ShapeGoal(_base.Message):
    """For the tutorials: draws a regular polygon."""
    edges: int
    """how many edges"""
    radius: float
    """m, of the circle through the corners"""
    def __init__(self, edges: int | None = ..., radius: float | None = ...) -> None: ...

class ShapeResult(_base.Message):
    interior_angle: float
    """rad, at each corner"""
    apothem: float
    """m, from the centre to the middle of an edge"""
    def __init__(self, interior_angle: float | None = ..., apothem: float | None = ...) -> None: ...
