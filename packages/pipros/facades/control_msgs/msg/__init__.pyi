"""Messages of control_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time
import actionlib_msgs.msg
import geometry_msgs.msg
import std_msgs.msg
import trajectory_msgs.msg

class FollowJointTrajectoryAction(_base.Message):
    action_goal: FollowJointTrajectoryActionGoal
    action_result: FollowJointTrajectoryActionResult
    action_feedback: FollowJointTrajectoryActionFeedback
    def __init__(self, action_goal: FollowJointTrajectoryActionGoal | None = ..., action_result: FollowJointTrajectoryActionResult | None = ..., action_feedback: FollowJointTrajectoryActionFeedback | None = ...) -> None: ...

class FollowJointTrajectoryActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: FollowJointTrajectoryFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: FollowJointTrajectoryFeedback | None = ...) -> None: ...

class FollowJointTrajectoryActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: FollowJointTrajectoryGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: FollowJointTrajectoryGoal | None = ...) -> None: ...

class FollowJointTrajectoryActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: FollowJointTrajectoryResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: FollowJointTrajectoryResult | None = ...) -> None: ...

class FollowJointTrajectoryFeedback(_base.Message):
    header: std_msgs.msg.Header
    """stamp: when the joints were in this state"""
    joint_names: list[str]
    """the joints, in the order of the values in each point"""
    desired: trajectory_msgs.msg.JointTrajectoryPoint
    """desired state at this time"""
    actual: trajectory_msgs.msg.JointTrajectoryPoint
    """actual state"""
    error: trajectory_msgs.msg.JointTrajectoryPoint
    """desired minus actual"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., desired: trajectory_msgs.msg.JointTrajectoryPoint | None = ..., actual: trajectory_msgs.msg.JointTrajectoryPoint | None = ..., error: trajectory_msgs.msg.JointTrajectoryPoint | None = ...) -> None: ...

class FollowJointTrajectoryGoal(_base.Message):
    """Moves joints along a trajectory, and monitors their deviation; joint_trajectory_controller serves it. A
    tolerance of 0 stands for the controller's configured value, and a negative tolerance for no limit."""
    trajectory: trajectory_msgs.msg.JointTrajectory
    """the desired motion of the joints"""
    path_tolerance: list[JointTolerance]
    """tolerance of each joint on the way; if it is exceeded, the goal is aborted"""
    goal_tolerance: list[JointTolerance]
    """tolerance of each joint at the end"""
    goal_time_tolerance: _time.Duration
    """maximum delay of the joints at the end"""
    def __init__(self, trajectory: trajectory_msgs.msg.JointTrajectory | None = ..., path_tolerance: list[JointTolerance] | None = ..., goal_tolerance: list[JointTolerance] | None = ..., goal_time_tolerance: _time.Duration | None = ...) -> None: ...

class FollowJointTrajectoryResult(_base.Message):
    SUCCESSFUL: _Final = 0
    """the joints arrived"""
    INVALID_GOAL: _Final = -1
    """the trajectory or a tolerance is invalid"""
    INVALID_JOINTS: _Final = -2
    """the joints are not those of the controller"""
    OLD_HEADER_TIMESTAMP: _Final = -3
    """the trajectory would already have ended"""
    PATH_TOLERANCE_VIOLATED: _Final = -4
    """a joint left its path tolerance"""
    GOAL_TOLERANCE_VIOLATED: _Final = -5
    """a joint missed its goal tolerance, or was late"""
    error_code: int
    """one of the constants below"""
    error_string: str
    """human-readable: what went wrong"""
    def __init__(self, error_code: int | None = ..., error_string: str | None = ...) -> None: ...

class GripperCommand(_base.Message):
    """A command for a gripper with two fingers."""
    position: float
    """usually the gap between the fingers, metres; for some drivers, the position of their joint"""
    max_effort: float
    """maximum force, newtons; the driver determines the meaning of 0 and negative values"""
    def __init__(self, position: float | None = ..., max_effort: float | None = ...) -> None: ...

class GripperCommandAction(_base.Message):
    action_goal: GripperCommandActionGoal
    action_result: GripperCommandActionResult
    action_feedback: GripperCommandActionFeedback
    def __init__(self, action_goal: GripperCommandActionGoal | None = ..., action_result: GripperCommandActionResult | None = ..., action_feedback: GripperCommandActionFeedback | None = ...) -> None: ...

class GripperCommandActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: GripperCommandFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: GripperCommandFeedback | None = ...) -> None: ...

class GripperCommandActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: GripperCommandGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: GripperCommandGoal | None = ...) -> None: ...

class GripperCommandActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: GripperCommandResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: GripperCommandResult | None = ...) -> None: ...

class GripperCommandFeedback(_base.Message):
    position: float
    """position of the gripper, in the unit of the command (usually the gap in metres)"""
    effort: float
    """exerted force, newtons"""
    stalled: bool
    """true if it exerts force without moving, as on an object"""
    reached_goal: bool
    """true if it is at the commanded position"""
    def __init__(self, position: float | None = ..., effort: float | None = ..., stalled: bool | None = ..., reached_goal: bool | None = ...) -> None: ...

class GripperCommandGoal(_base.Message):
    """Opens or closes a gripper with two fingers until it reaches the position or grips an object."""
    command: GripperCommand
    """position and maximum force"""
    def __init__(self, command: GripperCommand | None = ...) -> None: ...

class GripperCommandResult(_base.Message):
    position: float
    """position of the gripper, in the unit of the command (usually the gap in metres)"""
    effort: float
    """exerted force, newtons"""
    stalled: bool
    """true if it exerts force without moving, as on an object"""
    reached_goal: bool
    """true if it is at the commanded position"""
    def __init__(self, position: float | None = ..., effort: float | None = ..., stalled: bool | None = ..., reached_goal: bool | None = ...) -> None: ...

class JointControllerState(_base.Message):
    """State of a PID controller of one joint, for tuning; controllers publish it on CONTROLLER/state."""
    header: std_msgs.msg.Header
    """stamp: when the joint was in this state"""
    set_point: float
    """desired value: radians, metres, or these per second"""
    process_value: float
    """actual value, in the same unit"""
    process_value_dot: float
    """its rate of change, per second"""
    error: float
    """set_point minus process_value"""
    time_step: float
    """time between two steps of the controller, seconds"""
    command: float
    """output to the joint: usually newton metres or newtons"""
    p: float
    """proportional gain"""
    i: float
    """integral gain"""
    d: float
    """derivative gain"""
    i_clamp: float
    """bound on the magnitude of the integral part"""
    antiwindup: bool
    """whether the integral stops growing at its bound"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., set_point: float | None = ..., process_value: float | None = ..., process_value_dot: float | None = ..., error: float | None = ..., time_step: float | None = ..., command: float | None = ..., p: float | None = ..., i: float | None = ..., d: float | None = ..., i_clamp: float | None = ..., antiwindup: bool | None = ...) -> None: ...

class JointJog(_base.Message):
    """Jogs joints: moves them by small steps, or for a short time, for example while a button is held down."""
    header: std_msgs.msg.Header
    """stamp: when it was sent"""
    joint_names: list[str]
    """the joints, in the order of the values"""
    @property
    def displacements(self) -> _Sequence[float]:
        """relative to the current positions, radians or metres; may be empty"""
    @displacements.setter
    def displacements(self, value: _types.Array[float]) -> None: ...
    @property
    def velocities(self) -> _Sequence[float]:
        """radians or metres per second; may be empty"""
    @velocities.setter
    def velocities(self, value: _types.Array[float]) -> None: ...
    duration: float
    """seconds"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., displacements: _types.Array[float] | None = ..., velocities: _types.Array[float] | None = ..., duration: float | None = ...) -> None: ...

class JointTolerance(_base.Message):
    """Tolerances for one joint. 0 stands for the controller's configured value, and a negative value for no limit."""
    name: str
    """the joint"""
    position: float
    """radians or metres"""
    velocity: float
    """radians or metres per second"""
    acceleration: float
    """radians or metres per second squared"""
    def __init__(self, name: str | None = ..., position: float | None = ..., velocity: float | None = ..., acceleration: float | None = ...) -> None: ...

class JointTrajectoryAction(_base.Message):
    action_goal: JointTrajectoryActionGoal
    action_result: JointTrajectoryActionResult
    action_feedback: JointTrajectoryActionFeedback
    def __init__(self, action_goal: JointTrajectoryActionGoal | None = ..., action_result: JointTrajectoryActionResult | None = ..., action_feedback: JointTrajectoryActionFeedback | None = ...) -> None: ...

class JointTrajectoryActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: JointTrajectoryFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: JointTrajectoryFeedback | None = ...) -> None: ...

class JointTrajectoryActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: JointTrajectoryGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: JointTrajectoryGoal | None = ...) -> None: ...

class JointTrajectoryActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: JointTrajectoryResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: JointTrajectoryResult | None = ...) -> None: ...

class JointTrajectoryControllerState(_base.Message):
    """Desired and actual state of joints on a trajectory; joint_trajectory_controller publishes it on
    CONTROLLER/state."""
    header: std_msgs.msg.Header
    """stamp: when the joints were in this state"""
    joint_names: list[str]
    """the joints, in the order of the values in each point"""
    desired: trajectory_msgs.msg.JointTrajectoryPoint
    """desired state at this time"""
    actual: trajectory_msgs.msg.JointTrajectoryPoint
    """actual state"""
    error: trajectory_msgs.msg.JointTrajectoryPoint
    """desired minus actual"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., desired: trajectory_msgs.msg.JointTrajectoryPoint | None = ..., actual: trajectory_msgs.msg.JointTrajectoryPoint | None = ..., error: trajectory_msgs.msg.JointTrajectoryPoint | None = ...) -> None: ...

class JointTrajectoryFeedback(_base.Message):
    def __init__(self) -> None: ...

class JointTrajectoryGoal(_base.Message):
    """Moves joints along a trajectory, without tolerances. FollowJointTrajectory returns more information.
    Result and feedback are empty."""
    trajectory: trajectory_msgs.msg.JointTrajectory
    """the desired motion of the joints"""
    def __init__(self, trajectory: trajectory_msgs.msg.JointTrajectory | None = ...) -> None: ...

class JointTrajectoryResult(_base.Message):
    def __init__(self) -> None: ...

class PidState(_base.Message):
    """Internal state of a PID controller in one step, for tuning."""
    header: std_msgs.msg.Header
    """stamp: time of the step"""
    timestep: _time.Duration
    """time since the previous step"""
    error: float
    """desired minus measured value"""
    error_dot: float
    """derivative of the error, per second"""
    p_error: float
    """error used for the proportional part"""
    i_error: float
    """integral of the error"""
    d_error: float
    """derivative of the error, per second"""
    p_term: float
    """proportional gain"""
    i_term: float
    """integral gain"""
    d_term: float
    """derivative gain"""
    i_max: float
    """upper bound of the integral part"""
    i_min: float
    """lower bound of the integral part"""
    output: float
    """output of the controller"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., timestep: _time.Duration | None = ..., error: float | None = ..., error_dot: float | None = ..., p_error: float | None = ..., i_error: float | None = ..., d_error: float | None = ..., p_term: float | None = ..., i_term: float | None = ..., d_term: float | None = ..., i_max: float | None = ..., i_min: float | None = ..., output: float | None = ...) -> None: ...

class PointHeadAction(_base.Message):
    action_goal: PointHeadActionGoal
    action_result: PointHeadActionResult
    action_feedback: PointHeadActionFeedback
    def __init__(self, action_goal: PointHeadActionGoal | None = ..., action_result: PointHeadActionResult | None = ..., action_feedback: PointHeadActionFeedback | None = ...) -> None: ...

class PointHeadActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: PointHeadFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: PointHeadFeedback | None = ...) -> None: ...

class PointHeadActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: PointHeadGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: PointHeadGoal | None = ...) -> None: ...

class PointHeadActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: PointHeadResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: PointHeadResult | None = ...) -> None: ...

class PointHeadFeedback(_base.Message):
    pointing_angle_error: float
    """angle between the axis and the point, radians"""
    def __init__(self, pointing_angle_error: float | None = ...) -> None: ...

class PointHeadGoal(_base.Message):
    """Turns a head, or a sensor on a pan-tilt unit, to look at a point. The result is empty."""
    target: geometry_msgs.msg.PointStamped
    """the point to look at, in any frame"""
    pointing_axis: geometry_msgs.msg.Vector3
    """the axis of pointing_frame to point at the target, such as (0, 0, 1)"""
    pointing_frame: str
    """the frame to turn, such as the optical frame of a camera"""
    min_duration: _time.Duration
    """take at least this long; 0: no bound"""
    max_velocity: float
    """of each joint, radians per second; 0: no bound"""
    def __init__(self, target: geometry_msgs.msg.PointStamped | None = ..., pointing_axis: geometry_msgs.msg.Vector3 | None = ..., pointing_frame: str | None = ..., min_duration: _time.Duration | None = ..., max_velocity: float | None = ...) -> None: ...

class PointHeadResult(_base.Message):
    def __init__(self) -> None: ...

class SingleJointPositionAction(_base.Message):
    action_goal: SingleJointPositionActionGoal
    action_result: SingleJointPositionActionResult
    action_feedback: SingleJointPositionActionFeedback
    def __init__(self, action_goal: SingleJointPositionActionGoal | None = ..., action_result: SingleJointPositionActionResult | None = ..., action_feedback: SingleJointPositionActionFeedback | None = ...) -> None: ...

class SingleJointPositionActionFeedback(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    feedback: SingleJointPositionFeedback
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., feedback: SingleJointPositionFeedback | None = ...) -> None: ...

class SingleJointPositionActionGoal(_base.Message):
    header: std_msgs.msg.Header
    goal_id: actionlib_msgs.msg.GoalID
    goal: SingleJointPositionGoal
    def __init__(self, header: std_msgs.msg.Header | None = ..., goal_id: actionlib_msgs.msg.GoalID | None = ..., goal: SingleJointPositionGoal | None = ...) -> None: ...

class SingleJointPositionActionResult(_base.Message):
    header: std_msgs.msg.Header
    status: actionlib_msgs.msg.GoalStatus
    result: SingleJointPositionResult
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: actionlib_msgs.msg.GoalStatus | None = ..., result: SingleJointPositionResult | None = ...) -> None: ...

class SingleJointPositionFeedback(_base.Message):
    header: std_msgs.msg.Header
    """stamp: when the joint was in this state"""
    position: float
    """position of the joint, radians or metres"""
    velocity: float
    """velocity, radians or metres per second"""
    error: float
    """distance from the commanded position, radians or metres"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., position: float | None = ..., velocity: float | None = ..., error: float | None = ...) -> None: ...

class SingleJointPositionGoal(_base.Message):
    """Moves one joint to a position. The result is empty."""
    position: float
    """radians for a revolute joint, metres for a prismatic one"""
    min_duration: _time.Duration
    """take at least this long; 0: no bound"""
    max_velocity: float
    """radians or metres per second; 0: no bound"""
    def __init__(self, position: float | None = ..., min_duration: _time.Duration | None = ..., max_velocity: float | None = ...) -> None: ...

class SingleJointPositionResult(_base.Message):
    def __init__(self) -> None: ...
