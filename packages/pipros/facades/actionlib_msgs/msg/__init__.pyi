"""Messages of actionlib_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import time as _time
import std_msgs.msg

class GoalID(_base.Message):
    """Identifies a goal of an action. On ACTION/cancel, it cancels goals: an id cancels that goal, a stamp cancels
    all goals up to that time, id and stamp do both, and an empty message cancels all goals."""
    stamp: _time.Time
    """when the goal was requested"""
    id: str
    """unique among all goals of the action; if it is empty, the server generates one"""
    def __init__(self, stamp: _time.Time | None = ..., id: str | None = ...) -> None: ...

class GoalStatus(_base.Message):
    """State of one goal, as the action server sees it. Terminal states are final."""
    PENDING: _Final = 0
    """received, but not yet processed"""
    ACTIVE: _Final = 1
    """being processed"""
    PREEMPTED: _Final = 2
    """cancelled while it was active; terminal"""
    SUCCEEDED: _Final = 3
    """reached; terminal"""
    ABORTED: _Final = 4
    """aborted by the server while it was active; terminal"""
    REJECTED: _Final = 5
    """rejected before it was active; terminal"""
    PREEMPTING: _Final = 6
    """cancellation was requested, but the goal is still active"""
    RECALLING: _Final = 7
    """cancellation was requested before the goal was active"""
    RECALLED: _Final = 8
    """cancelled before it was active; terminal"""
    LOST: _Final = 9
    """set by clients if their goal is no longer in the server's list; never sent"""
    goal_id: GoalID
    """the goal"""
    status: int
    """PENDING to LOST"""
    text: str
    """human-readable: why the goal is in this state; may be empty"""
    def __init__(self, goal_id: GoalID | None = ..., status: int | None = ..., text: str | None = ...) -> None: ...

class GoalStatusArray(_base.Message):
    """States of all goals that an action server knows, including those that ended a few seconds ago. The server
    publishes them on ACTION/status several times a second, so that clients also see that it is running."""
    header: std_msgs.msg.Header
    """stamp: when the list was created; frame_id is not used"""
    status_list: list[GoalStatus]
    """empty if there are no goals"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., status_list: list[GoalStatus] | None = ...) -> None: ...
