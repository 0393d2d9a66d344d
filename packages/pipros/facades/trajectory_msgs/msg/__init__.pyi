"""Messages of trajectory_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time
import geometry_msgs.msg
import std_msgs.msg

class JointTrajectory(_base.Message):
    """A motion of joints over time, for controllers (ARM_CONTROLLER/command), from planners such as MoveIt."""
    header: std_msgs.msg.Header
    """stamp: when to begin; 0: immediately. frame_id is not used"""
    joint_names: list[str]
    """the joints, in the order of the values in each point"""
    points: list[JointTrajectoryPoint]
    """ordered by time_from_start"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., points: list[JointTrajectoryPoint] | None = ...) -> None: ...

class JointTrajectoryPoint(_base.Message):
    """Desired state of the joints at one time of a trajectory. An array has a value for each joint, or is empty."""
    @property
    def positions(self) -> _Sequence[float]:
        """radians for revolute joints, metres for prismatic ones"""
    @positions.setter
    def positions(self, value: _types.Array[float]) -> None: ...
    @property
    def velocities(self) -> _Sequence[float]:
        """radians or metres per second"""
    @velocities.setter
    def velocities(self, value: _types.Array[float]) -> None: ...
    @property
    def accelerations(self) -> _Sequence[float]:
        """radians or metres per second squared"""
    @accelerations.setter
    def accelerations(self, value: _types.Array[float]) -> None: ...
    @property
    def effort(self) -> _Sequence[float]:
        """newton metres or newtons; added to the controller's output, or used instead of it"""
    @effort.setter
    def effort(self, value: _types.Array[float]) -> None: ...
    time_from_start: _time.Duration
    """since the beginning of the trajectory; increases from point to point"""
    def __init__(self, positions: _types.Array[float] | None = ..., velocities: _types.Array[float] | None = ..., accelerations: _types.Array[float] | None = ..., effort: _types.Array[float] | None = ..., time_from_start: _time.Duration | None = ...) -> None: ...

class MultiDOFJointTrajectory(_base.Message):
    """A motion over time of joints with several degrees of freedom, such as a mobile or flying base."""
    header: std_msgs.msg.Header
    """stamp: when to begin; 0: immediately. frame_id: the frame of the transforms"""
    joint_names: list[str]
    """the joints, in the order of the values in each point"""
    points: list[MultiDOFJointTrajectoryPoint]
    """ordered by time_from_start"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., points: list[MultiDOFJointTrajectoryPoint] | None = ...) -> None: ...

class MultiDOFJointTrajectoryPoint(_base.Message):
    """Desired state of joints with several degrees of freedom at one time. An array has an element for each joint,
    or is empty."""
    transforms: list[geometry_msgs.msg.Transform]
    """poses, metres and unit quaternions"""
    velocities: list[geometry_msgs.msg.Twist]
    """metres and radians per second"""
    accelerations: list[geometry_msgs.msg.Twist]
    """metres and radians per second squared"""
    time_from_start: _time.Duration
    """since the beginning of the trajectory; increases from point to point"""
    def __init__(self, transforms: list[geometry_msgs.msg.Transform] | None = ..., velocities: list[geometry_msgs.msg.Twist] | None = ..., accelerations: list[geometry_msgs.msg.Twist] | None = ..., time_from_start: _time.Duration | None = ...) -> None: ...
