"""Messages of actionlib_tutorials, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import actionlib_msgs.msg
import std_msgs.msg

class AveragingAction(_base.Message):
    action_goal: AveragingActionGoal
    action_result: AveragingActionResult
    action_feedback: AveragingActionFeedback
    def __init__(self, action_goal: AveragingActionGoal | None = ..., action_result: AveragingActionResult | None = ..., action_feedback: AveragingActionFeedback | None = ...) -> None: ...

class AveragingActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: AveragingFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: AveragingFeedback | None = ...) -> None: ...

class AveragingActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: AveragingGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: AveragingGoal | None = ...) -> None: ...

class AveragingActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: AveragingResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: AveragingResult | None = ...) -> None: ...

class AveragingFeedback(_base.Message):
    sample: int
    """how many numbers have arrived"""
    data: float
    """the latest of them"""
    mean: float
    """mean so far"""
    std_dev: float
    """standard deviation so far"""
    def __init__(self, sample: int | None = ..., data: float | None = ..., mean: float | None = ..., std_dev: float | None = ...) -> None: ...

class AveragingGoal(_base.Message):
    """For the tutorials: averages numbers that arrive on a topic."""
    samples: int
    """how many numbers to average"""
    def __init__(self, samples: int | None = ...) -> None: ...

class AveragingResult(_base.Message):
    mean: float
    """their mean"""
    std_dev: float
    """their standard deviation"""
    def __init__(self, mean: float | None = ..., std_dev: float | None = ...) -> None: ...

class FibonacciAction(_base.Message):
    action_goal: FibonacciActionGoal
    action_result: FibonacciActionResult
    action_feedback: FibonacciActionFeedback
    def __init__(self, action_goal: FibonacciActionGoal | None = ..., action_result: FibonacciActionResult | None = ..., action_feedback: FibonacciActionFeedback | None = ...) -> None: ...

class FibonacciActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: FibonacciFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: FibonacciFeedback | None = ...) -> None: ...

class FibonacciActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: FibonacciGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: FibonacciGoal | None = ...) -> None: ...

class FibonacciActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: FibonacciResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: FibonacciResult | None = ...) -> None: ...

class FibonacciFeedback(_base.Message):
    @property
    def sequence(self) -> _Sequence[int]:
        """the sequence so far"""
    @sequence.setter
    def sequence(self, value: _types.Array[int]) -> None: ...
    def __init__(self, sequence: _types.Array[int] | None = ...) -> None: ...

class FibonacciGoal(_base.Message):
    """For the tutorials: computes the Fibonacci sequence."""
    order: int
    """how far to compute it"""
    def __init__(self, order: int | None = ...) -> None: ...

class FibonacciResult(_base.Message):
    @property
    def sequence(self) -> _Sequence[int]:
        """the whole sequence, from 0, 1 on"""
    @sequence.setter
    def sequence(self, value: _types.Array[int]) -> None: ...
    def __init__(self, sequence: _types.Array[int] | None = ...) -> None: ...
