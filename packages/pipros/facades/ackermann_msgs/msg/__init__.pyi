"""Messages of ackermann_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import std_msgs.msg

class AckermannDrive(_base.Message):
    """Command for a vehicle that steers like a car, or the measured values of such a vehicle. The values refer to
    the middle of the rear axle. A rate of 0 leaves the vehicle to choose how fast it reaches a value."""
    steering_angle: float
    """angle of a wheel in the middle of the front axle, in rad; positive is left"""
    steering_angle_velocity: float
    """how fast the angle changes, in rad/s; 0: as fast as possible"""
    speed: float
    """forward speed in m/s; negative drives backwards"""
    acceleration: float
    """how fast the speed changes, in m/s^2; 0: as fast as possible"""
    jerk: float
    """how fast the acceleration changes, in m/s^3; 0: as fast as possible"""
    def __init__(self, steering_angle: float | None = ..., steering_angle_velocity: float | None = ..., speed: float | None = ..., acceleration: float | None = ..., jerk: float | None = ...) -> None: ...

class AckermannDriveStamped(_base.Message):
    """AckermannDrive with the time at which it applies. The topic is often /drive or /ackermann_cmd."""
    header: std_msgs.msg.Header
    """stamp: when the values apply; frame_id is not used"""
    drive: AckermannDrive
    """the command or the values"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., drive: AckermannDrive | None = ...) -> None: ...
