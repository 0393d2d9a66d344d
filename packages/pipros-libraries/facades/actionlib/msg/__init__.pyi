"""Messages of actionlib, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import time as _time
import actionlib_msgs.msg
import std_msgs.msg

class TestAction(_base.Message):
    action_goal: TestActionGoal
    action_result: TestActionResult
    action_feedback: TestActionFeedback
    def __init__(self, action_goal: TestActionGoal | None = ..., action_result: TestActionResult | None = ..., action_feedback: TestActionFeedback | None = ...) -> None: ...

class TestActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: TestFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: TestFeedback | None = ...) -> None: ...

class TestActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: TestGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: TestGoal | None = ...) -> None: ...

class TestActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: TestResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: TestResult | None = ...) -> None: ...

class TestFeedback(_base.Message):
    feedback: int
    """defined by the test"""
    def __init__(self, feedback: int | None = ...) -> None: ...

class TestGoal(_base.Message):
    """For tests of actionlib: one number in each direction."""
    goal: int
    """defined by the test"""
    def __init__(self, goal: int | None = ...) -> None: ...

class TestRequestAction(_base.Message):
    action_goal: TestRequestActionGoal
    action_result: TestRequestActionResult
    action_feedback: TestRequestActionFeedback
    def __init__(self, action_goal: TestRequestActionGoal | None = ..., action_result: TestRequestActionResult | None = ..., action_feedback: TestRequestActionFeedback | None = ...) -> None: ...

class TestRequestActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: TestRequestFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: TestRequestFeedback | None = ...) -> None: ...

class TestRequestActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: TestRequestGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: TestRequestGoal | None = ...) -> None: ...

class TestRequestActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: TestRequestResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: TestRequestResult | None = ...) -> None: ...

class TestRequestFeedback(_base.Message):
    def __init__(self) -> None: ...

class TestRequestGoal(_base.Message):
    """For tests of actionlib: the goal determines how the server ends it."""
    TERMINATE_SUCCESS: _Final = 0
    """succeed"""
    TERMINATE_ABORTED: _Final = 1
    """abort"""
    TERMINATE_REJECTED: _Final = 2
    """reject"""
    TERMINATE_LOSE: _Final = 3
    """lose the goal"""
    TERMINATE_DROP: _Final = 4
    """drop the handle of the goal without a status"""
    TERMINATE_EXCEPTION: _Final = 5
    """raise an exception"""
    terminate_status: int
    """one of TERMINATE_..."""
    ignore_cancel: bool
    """whether to ignore cancellation requests"""
    result_text: str
    """text of the status at the end"""
    the_result: int
    """the number to return"""
    is_simple_client: bool
    """true if sent by a simple action client"""
    delay_accept: _time.Duration
    """wait this long before the goal is accepted"""
    delay_terminate: _time.Duration
    """wait this long before the goal ends"""
    pause_status: _time.Duration
    """publish no status for this long"""
    def __init__(self, terminate_status: int | None = ..., ignore_cancel: bool | None = ..., result_text: str | None = ..., the_result: int | None = ..., is_simple_client: bool | None = ..., delay_accept: _time.Duration | None = ..., delay_terminate: _time.Duration | None = ..., pause_status: _time.Duration | None = ...) -> None: ...

class TestRequestResult(_base.Message):
    the_result: int
    """the number of the goal"""
    is_simple_server: bool
    """true if the server is a simple action server"""
    def __init__(self, the_result: int | None = ..., is_simple_server: bool | None = ...) -> None: ...

class TestResult(_base.Message):
    result: int
    """defined by the test"""
    def __init__(self, result: int | None = ...) -> None: ...

class TwoIntsAction(_base.Message):
    action_goal: TwoIntsActionGoal
    action_result: TwoIntsActionResult
    action_feedback: TwoIntsActionFeedback
    def __init__(self, action_goal: TwoIntsActionGoal | None = ..., action_result: TwoIntsActionResult | None = ..., action_feedback: TwoIntsActionFeedback | None = ...) -> None: ...

class TwoIntsActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: TwoIntsFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: TwoIntsFeedback | None = ...) -> None: ...

class TwoIntsActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: TwoIntsGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: TwoIntsGoal | None = ...) -> None: ...

class TwoIntsActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: TwoIntsResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: TwoIntsResult | None = ...) -> None: ...

class TwoIntsFeedback(_base.Message):
    def __init__(self) -> None: ...

class TwoIntsGoal(_base.Message):
    """For tests of actionlib: adds two numbers. The feedback is empty."""
    a: int
    """first summand"""
    b: int
    """second summand"""
    def __init__(self, a: int | None = ..., b: int | None = ...) -> None: ...

class TwoIntsResult(_base.Message):
    sum: int
    """a plus b"""
    def __init__(self, sum: int | None = ...) -> None: ...
