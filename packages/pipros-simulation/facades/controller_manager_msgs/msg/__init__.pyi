"""Messages of controller_manager_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
from pipros.msg import time as _time
import std_msgs.msg

class ControllerState(_base.Message):
    """A controller that is loaded."""
    name: str
    """name of the controller, and of the namespace of its parameters"""
    state: str
    """initialized, running or stopped"""
    type: str
    """type of the plugin, such as diff_drive_controller/DiffDriveController"""
    claimed_resources: list[HardwareInterfaceResources]
    """what the controller uses"""
    def __init__(self, name: str | None = ..., state: str | None = ..., type: str | None = ..., claimed_resources: list[HardwareInterfaceResources] | None = ...) -> None: ...

class ControllerStatistics(_base.Message):
    """How long the updates of a controller take."""
    name: str
    """name of the controller"""
    type: str
    """type of the plugin"""
    timestamp: _time.Time
    """time of these statistics"""
    running: bool
    """whether the controller is running"""
    max_time: _time.Duration
    """longest duration of an update"""
    mean_time: _time.Duration
    """mean duration of an update"""
    variance_time: _time.Duration
    """variance of the duration of an update"""
    num_control_loop_overruns: int
    """updates that took too long"""
    time_last_control_loop_overrun: _time.Time
    """time of the last such update"""
    def __init__(self, name: str | None = ..., type: str | None = ..., timestamp: _time.Time | None = ..., running: bool | None = ..., max_time: _time.Duration | None = ..., mean_time: _time.Duration | None = ..., variance_time: _time.Duration | None = ..., num_control_loop_overruns: int | None = ..., time_last_control_loop_overrun: _time.Time | None = ...) -> None: ...

class ControllersStatistics(_base.Message):
    """Statistics of all controllers of a manager."""
    header: std_msgs.msg.Header
    """time of the statistics"""
    controller: list[ControllerStatistics]
    """one entry for each controller"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., controller: list[ControllerStatistics] | None = ...) -> None: ...

class HardwareInterfaceResources(_base.Message):
    """Resources of a hardware interface that a controller claims."""
    hardware_interface: str
    """type of the interface, such as hardware_interface::VelocityJointInterface"""
    resources: list[str]
    """names of resources, such as joints"""
    def __init__(self, hardware_interface: str | None = ..., resources: list[str] | None = ...) -> None: ...
