"""Messages of sensor_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
from pipros.msg import time as _time
import geometry_msgs.msg
import std_msgs.msg

class BatteryState(_base.Message):
    """State of one battery or pack, from its driver, usually about once a second. A value that the hardware does
    not measure is NaN, so that it cannot be confused with zero."""
    POWER_SUPPLY_STATUS_UNKNOWN: _Final = 0
    """the driver cannot tell"""
    POWER_SUPPLY_STATUS_CHARGING: _Final = 1
    """current flows into the battery"""
    POWER_SUPPLY_STATUS_DISCHARGING: _Final = 2
    """current flows out of the battery"""
    POWER_SUPPLY_STATUS_NOT_CHARGING: _Final = 3
    """a charger is connected, but does not charge"""
    POWER_SUPPLY_STATUS_FULL: _Final = 4
    """charging has ended"""
    POWER_SUPPLY_HEALTH_UNKNOWN: _Final = 0
    """the driver cannot tell"""
    POWER_SUPPLY_HEALTH_GOOD: _Final = 1
    """fit for use"""
    POWER_SUPPLY_HEALTH_OVERHEAT: _Final = 2
    """too hot"""
    POWER_SUPPLY_HEALTH_DEAD: _Final = 3
    """worn out"""
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: _Final = 4
    """voltage too high"""
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: _Final = 5
    """a failure that the driver cannot name"""
    POWER_SUPPLY_HEALTH_COLD: _Final = 6
    """too cold"""
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: _Final = 7
    """the charger's watchdog ended charging"""
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: _Final = 8
    """charging took too long"""
    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: _Final = 0
    """the driver cannot tell"""
    POWER_SUPPLY_TECHNOLOGY_NIMH: _Final = 1
    """nickel metal hydride"""
    POWER_SUPPLY_TECHNOLOGY_LION: _Final = 2
    """lithium ion"""
    POWER_SUPPLY_TECHNOLOGY_LIPO: _Final = 3
    """lithium polymer"""
    POWER_SUPPLY_TECHNOLOGY_LIFE: _Final = 4
    """lithium iron phosphate"""
    POWER_SUPPLY_TECHNOLOGY_NICD: _Final = 5
    """nickel cadmium"""
    POWER_SUPPLY_TECHNOLOGY_LIMN: _Final = 6
    """lithium manganese"""
    header: std_msgs.msg.Header
    """stamp: time of the measurement"""
    voltage: float
    """volts, of the whole pack"""
    temperature: float
    """degrees Celsius"""
    current: float
    """amperes; negative while the battery is discharged"""
    charge: float
    """remaining ampere hours"""
    capacity: float
    """ampere hours when full, as last measured"""
    design_capacity: float
    """ampere hours when full and new"""
    percentage: float
    """remaining fraction of the capacity, from 0 to 1 (not 100)"""
    power_supply_status: int
    """one of POWER_SUPPLY_STATUS_..."""
    power_supply_health: int
    """one of POWER_SUPPLY_HEALTH_..."""
    power_supply_technology: int
    """one of POWER_SUPPLY_TECHNOLOGY_..."""
    present: bool
    """true if a battery is installed"""
    @property
    def cell_voltage(self) -> _Sequence[float]:
        """volts of each cell; empty if cells are not measured"""
    @cell_voltage.setter
    def cell_voltage(self, value: _types.Array[float]) -> None: ...
    @property
    def cell_temperature(self) -> _Sequence[float]:
        """degrees Celsius of each cell; empty if cells are not measured"""
    @cell_temperature.setter
    def cell_temperature(self, value: _types.Array[float]) -> None: ...
    location: str
    """where the battery is installed, such as the name of a slot"""
    serial_number: str
    """identifies the battery; may be empty"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., voltage: float | None = ..., temperature: float | None = ..., current: float | None = ..., charge: float | None = ..., capacity: float | None = ..., design_capacity: float | None = ..., percentage: float | None = ..., power_supply_status: int | None = ..., power_supply_health: int | None = ..., power_supply_technology: int | None = ..., present: bool | None = ..., cell_voltage: _types.Array[float] | None = ..., cell_temperature: _types.Array[float] | None = ..., location: str | None = ..., serial_number: str | None = ...) -> None: ...

class CameraInfo(_base.Message):
    """Calibration of a camera, published beside its images as camera_info, with the stamp and frame_id of the
    image. The frame is the optical one: z forward, x right and y down in the image (REP 103). Matrices are
    written row by row. fx and fy are focal lengths, (cx, cy) is the principal point; all in pixels. K[0] is
    0 if the camera is not calibrated."""
    header: std_msgs.msg.Header
    """the same stamp as the image; frame_id: the optical frame of the camera"""
    height: int
    """rows of the full image for which the camera was calibrated, pixels"""
    width: int
    """columns of that image, pixels"""
    distortion_model: str
    """The lens model of D: plumb_bob (5 values), rational_polynomial (8) or equidistant (4, for
    fisheyes)."""
    @property
    def D(self) -> _Sequence[float]:
        """the model's coefficients; for plumb_bob k1, k2, t1, t2, k3. empty if not calibrated"""
    @D.setter
    def D(self, value: _types.Array[float]) -> None: ...
    @property
    def K(self) -> _Sequence[float]:
        """3 by 3: fx 0 cx, 0 fy cy, 0 0 1. Projects onto the raw image, without distortion"""
    @K.setter
    def K(self, value: _types.Array[float]) -> None: ...
    @property
    def R(self) -> _Sequence[float]:
        """3 by 3 rotation that makes the images of a stereo pair parallel; identity for a single camera"""
    @R.setter
    def R(self, value: _types.Array[float]) -> None: ...
    @property
    def P(self) -> _Sequence[float]:
        """3 by 4: fx 0 cx Tx, 0 fy cy Ty, 0 0 1 0. Projects points of the optical frame onto the rectified image; Tx
        is 0, except for the right camera of a stereo pair: minus fx times the baseline in metres."""
    @P.setter
    def P(self, value: _types.Array[float]) -> None: ...
    binning_x: int
    """number of columns of the full image that form one column; 0 means 1"""
    binning_y: int
    """number of rows of the full image that form one row; 0 means 1"""
    roi: RegionOfInterest
    """the part of the full image that is sent, before binning; all zeros: the whole image"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., height: int | None = ..., width: int | None = ..., distortion_model: str | None = ..., D: _types.Array[float] | None = ..., K: _types.Array[float] | None = ..., R: _types.Array[float] | None = ..., P: _types.Array[float] | None = ..., binning_x: int | None = ..., binning_y: int | None = ..., roi: RegionOfInterest | None = ...) -> None: ...

class ChannelFloat32(_base.Message):
    """An additional value for each point of a PointCloud."""
    name: str
    """meaning of the values: intensity, distance, u and v for pixels, r, g and b or rgb for colour"""
    @property
    def values(self) -> _Sequence[float]:
        """as many as there are points, in the same order"""
    @values.setter
    def values(self, value: _types.Array[float]) -> None: ...
    def __init__(self, name: str | None = ..., values: _types.Array[float] | None = ...) -> None: ...

class CompressedImage(_base.Message):
    """An image in the format of an image file, as published by image_transport on IMAGE_TOPIC/compressed."""
    header: std_msgs.msg.Header
    """as in Image: when the exposure began, and the optical frame of the camera"""
    format: str
    """jpeg or png; with image_transport, between the encodings of pixels: rgb8; jpeg compressed bgr8"""
    @property
    def data(self) -> bytes:
        """contents of the file"""
    @data.setter
    def data(self, value: _types.Octets) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., format: str | None = ..., data: _types.Octets | None = ...) -> None: ...

class FluidPressure(_base.Message):
    """Absolute pressure of a gas or liquid, from a barometer or a depth sensor."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: where the sensor is"""
    fluid_pressure: float
    """pascals; absolute, not relative to the atmosphere"""
    variance: float
    """pascals squared; 0: unknown"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., fluid_pressure: float | None = ..., variance: float | None = ...) -> None: ...

class Illuminance(_base.Message):
    """Illuminance on the surface of a light sensor, weighted as by the human eye."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: the sensor, which looks along its x axis"""
    illuminance: float
    """lux"""
    variance: float
    """lux squared; 0: unknown"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., illuminance: float | None = ..., variance: float | None = ...) -> None: ...

class Image(_base.Message):
    """An uncompressed image, row by row from the top left. Its frame is optical: z forward, x right, y down.
    Its CameraInfo has the same header."""
    header: std_msgs.msg.Header
    """stamp: the time of exposure; frame_id: the optical frame of the camera"""
    height: int
    """rows"""
    width: int
    """columns"""
    encoding: str
    """How a pixel is stored: mono8, mono16, rgb8, bgr8, rgba8, bayer_rggb8, 16UC1 (depth in millimetres), 32FC1
    (depth in metres) and others; sensor_msgs/image_encodings.h lists them all."""
    is_bigendian: int
    """1 if the most significant byte of a value is first; 0 on nearly all machines"""
    step: int
    """bytes from one row to the next; at least width times the bytes per pixel"""
    @property
    def data(self) -> bytes:
        """height times step bytes"""
    @data.setter
    def data(self, value: _types.Octets) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., height: int | None = ..., width: int | None = ..., encoding: str | None = ..., is_bigendian: int | None = ..., step: int | None = ..., data: _types.Octets | None = ...) -> None: ...

class Imu(_base.Message):
    """Reading of an inertial measurement unit, in the frame of the sensor. Each covariance is a 3 by 3 matrix, row
    after row, over x, y, z: all zeros mean that it is unknown, and a first element of -1 means that the sensor
    lacks this value."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: the frame of the sensor"""
    orientation: geometry_msgs.msg.Quaternion
    """of the sensor in a fixed frame: x east, y north, z up (REP 103)"""
    @property
    def orientation_covariance(self) -> _Sequence[float]:
        """radians squared, about x, y, z"""
    @orientation_covariance.setter
    def orientation_covariance(self, value: _types.Array[float]) -> None: ...
    angular_velocity: geometry_msgs.msg.Vector3
    """radians per second, about the axes of the sensor"""
    @property
    def angular_velocity_covariance(self) -> _Sequence[float]:
        """radians squared per second squared"""
    @angular_velocity_covariance.setter
    def angular_velocity_covariance(self, value: _types.Array[float]) -> None: ...
    linear_acceleration: geometry_msgs.msg.Vector3
    """m/s^2, gravity included: at rest and level, z reads about +9.8"""
    @property
    def linear_acceleration_covariance(self) -> _Sequence[float]:
        """m^2/s^4"""
    @linear_acceleration_covariance.setter
    def linear_acceleration_covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., orientation: geometry_msgs.msg.Quaternion | None = ..., orientation_covariance: _types.Array[float] | None = ..., angular_velocity: geometry_msgs.msg.Vector3 | None = ..., angular_velocity_covariance: _types.Array[float] | None = ..., linear_acceleration: geometry_msgs.msg.Vector3 | None = ..., linear_acceleration_covariance: _types.Array[float] | None = ...) -> None: ...

class JointState(_base.Message):
    """State of the joints of a robot, published on joint_states by drivers and simulators. robot_state_publisher
    computes transforms from it. Element i of each array belongs to name[i]; an array without data is empty."""
    header: std_msgs.msg.Header
    """stamp: when the joints were in this state; frame_id is not used"""
    name: list[str]
    """names of the joints, as in the URDF"""
    @property
    def position(self) -> _Sequence[float]:
        """radians for revolute joints, metres for prismatic ones"""
    @position.setter
    def position(self, value: _types.Array[float]) -> None: ...
    @property
    def velocity(self) -> _Sequence[float]:
        """radians per second, or metres per second"""
    @velocity.setter
    def velocity(self, value: _types.Array[float]) -> None: ...
    @property
    def effort(self) -> _Sequence[float]:
        """newton metres of torque, or newtons of force"""
    @effort.setter
    def effort(self, value: _types.Array[float]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., name: list[str] | None = ..., position: _types.Array[float] | None = ..., velocity: _types.Array[float] | None = ..., effort: _types.Array[float] | None = ...) -> None: ...

class Joy(_base.Message):
    """State of a joystick or gamepad, on the topic joy. The device determines which control has which index."""
    header: std_msgs.msg.Header
    """stamp: when the device reported"""
    @property
    def axes(self) -> _Sequence[float]:
        """from -1 to 1; sticks are positive to the left and up"""
    @axes.setter
    def axes(self, value: _types.Array[float]) -> None: ...
    @property
    def buttons(self) -> _Sequence[int]:
        """1 while pressed, otherwise 0"""
    @buttons.setter
    def buttons(self, value: _types.Array[int]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., axes: _types.Array[float] | None = ..., buttons: _types.Array[int] | None = ...) -> None: ...

class JoyFeedback(_base.Message):
    """A command for a light, vibration motor or buzzer of a joystick."""
    TYPE_LED: _Final = 0
    """a light"""
    TYPE_RUMBLE: _Final = 1
    """a vibration motor"""
    TYPE_BUZZER: _Final = 2
    """a buzzer"""
    type: int
    """one of TYPE_..."""
    id: int
    """index among the device's lights, motors or buzzers, from 0"""
    intensity: float
    """from 0 (off) to 1 (full); if the device supports only on and off, values from 0.5 mean on"""
    def __init__(self, type: int | None = ..., id: int | None = ..., intensity: float | None = ...) -> None: ...

class JoyFeedbackArray(_base.Message):
    """Several commands for the lights, motors and buzzers of a joystick, on joy/set_feedback."""
    array: list[JoyFeedback]
    """one for each output that changes"""
    def __init__(self, array: list[JoyFeedback] | None = ...) -> None: ...

class LaserEcho(_base.Message):
    """The echoes of one beam of a MultiEchoLaserScan, nearest first: ranges, or the strengths of the same echoes."""
    @property
    def echoes(self) -> _Sequence[float]:
        """metres for ranges, the device's own unit for strengths; empty if there was no echo"""
    @echoes.setter
    def echoes(self, value: _types.Array[float]) -> None: ...
    def __init__(self, echoes: _types.Array[float] | None = ...) -> None: ...

class LaserScan(_base.Message):
    """One sweep of a planar laser scanner. Beams lie in the x-y plane of the sensor frame; angle 0 is along x, and
    angles grow counter-clockwise about z. Beam i has the angle angle_min + i * angle_increment."""
    header: std_msgs.msg.Header
    """stamp: when the first beam was measured; frame_id: the frame of the scanner"""
    angle_min: float
    """angle of the first beam, radians"""
    angle_max: float
    """angle of the last beam, radians"""
    angle_increment: float
    """from one beam to the next, radians; negative if the scanner turns clockwise"""
    time_increment: float
    """from one beam to the next, seconds; 0 if all are measured at once"""
    scan_time: float
    """from the beginning of one scan to the beginning of the next, seconds"""
    range_min: float
    """shortest range that can be measured, metres"""
    range_max: float
    """longest range that can be measured, metres"""
    @property
    def ranges(self) -> _Sequence[float]:
        """Metres, one per beam. Ignore values outside range_min and range_max. REP 117: +Inf means nothing in range,
        -Inf an object too near to measure, NaN an invalid reading."""
    @ranges.setter
    def ranges(self, value: _types.Array[float]) -> None: ...
    @property
    def intensities(self) -> _Sequence[float]:
        """strength of each echo in the device's own unit; empty if it provides none"""
    @intensities.setter
    def intensities(self, value: _types.Array[float]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., angle_min: float | None = ..., angle_max: float | None = ..., angle_increment: float | None = ..., time_increment: float | None = ..., scan_time: float | None = ..., range_min: float | None = ..., range_max: float | None = ..., ranges: _types.Array[float] | None = ..., intensities: _types.Array[float] | None = ...) -> None: ...

class MagneticField(_base.Message):
    """Reading of a magnetometer, in the frame of the sensor, which may differ from the frame of a neighbouring
    IMU."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: the frame of the sensor"""
    magnetic_field: geometry_msgs.msg.Vector3
    """teslas; NaN along an axis that is not measured"""
    @property
    def magnetic_field_covariance(self) -> _Sequence[float]:
        """Teslas squared, 3 by 3 over x, y, z, row by row. All zeros: unknown."""
    @magnetic_field_covariance.setter
    def magnetic_field_covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, header: std_msgs.msg.Header | None = ..., magnetic_field: geometry_msgs.msg.Vector3 | None = ..., magnetic_field_covariance: _types.Array[float] | None = ...) -> None: ...

class MultiDOFJointState(_base.Message):
    """State of joints with several degrees of freedom, such as a floating base. Element i of each array belongs
    to joint_names[i]; an array without data is empty."""
    header: std_msgs.msg.Header
    """stamp: when the joints were in this state; frame_id: the frame in which they are given"""
    joint_names: list[str]
    """names of the joints, as in the robot's model"""
    transforms: list[geometry_msgs.msg.Transform]
    """pose of each joint, metres and unit quaternions"""
    twist: list[geometry_msgs.msg.Twist]
    """velocity of each joint, metres and radians per second"""
    wrench: list[geometry_msgs.msg.Wrench]
    """force and torque at each joint, newtons and newton metres"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., joint_names: list[str] | None = ..., transforms: list[geometry_msgs.msg.Transform] | None = ..., twist: list[geometry_msgs.msg.Twist] | None = ..., wrench: list[geometry_msgs.msg.Wrench] | None = ...) -> None: ...

class MultiEchoLaserScan(_base.Message):
    """One sweep of a planar laser scanner that reports several echoes of one beam, as behind glass or in rain.
    Axes, angles and times are those of LaserScan."""
    header: std_msgs.msg.Header
    """stamp: when the first beam was measured; frame_id: the frame of the scanner"""
    angle_min: float
    """angle of the first beam, radians"""
    angle_max: float
    """angle of the last beam, radians"""
    angle_increment: float
    """from one beam to the next, radians"""
    time_increment: float
    """from one beam to the next, seconds"""
    scan_time: float
    """from the beginning of one scan to the beginning of the next, seconds"""
    range_min: float
    """shortest range that can be measured, metres"""
    range_max: float
    """longest range that can be measured, metres"""
    ranges: list[LaserEcho]
    """the echoes of each beam, metres; +Inf, -Inf and NaN as in LaserScan"""
    intensities: list[LaserEcho]
    """strengths of the same echoes; empty if the device provides none"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., angle_min: float | None = ..., angle_max: float | None = ..., angle_increment: float | None = ..., time_increment: float | None = ..., scan_time: float | None = ..., range_min: float | None = ..., range_max: float | None = ..., ranges: list[LaserEcho] | None = ..., intensities: list[LaserEcho] | None = ...) -> None: ...

class NavSatFix(_base.Message):
    """A position from a satellite receiver, on the ellipsoid WGS 84."""
    COVARIANCE_TYPE_UNKNOWN: _Final = 0
    """the covariance must not be used"""
    COVARIANCE_TYPE_APPROXIMATED: _Final = 1
    """estimated from the dilution of precision"""
    COVARIANCE_TYPE_DIAGONAL_KNOWN: _Final = 2
    """the receiver gave the variances only"""
    COVARIANCE_TYPE_KNOWN: _Final = 3
    """the receiver gave the whole matrix"""
    header: std_msgs.msg.Header
    """stamp: the time of the fix, not of its receipt; frame_id: the antenna"""
    status: NavSatStatus
    """whether there is a fix, and from which satellites"""
    latitude: float
    """degrees; north of the equator is positive"""
    longitude: float
    """degrees; east of Greenwich is positive"""
    altitude: float
    """metres above the ellipsoid, not above sea level; NaN: unknown"""
    @property
    def position_covariance(self) -> _Sequence[float]:
        """Metres squared, 3 by 3 over east, north and up at the antenna, row by row."""
    @position_covariance.setter
    def position_covariance(self, value: _types.Array[float]) -> None: ...
    position_covariance_type: int
    """one of COVARIANCE_TYPE_..."""
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: NavSatStatus | None = ..., latitude: float | None = ..., longitude: float | None = ..., altitude: float | None = ..., position_covariance: _types.Array[float] | None = ..., position_covariance_type: int | None = ...) -> None: ...

class NavSatStatus(_base.Message):
    """Whether a satellite receiver has a fix, how it is corrected, and which systems it uses."""
    STATUS_NO_FIX: _Final = -1
    """no position"""
    STATUS_FIX: _Final = 0
    """an uncorrected position"""
    STATUS_SBAS_FIX: _Final = 1
    """corrected by satellites (WAAS, EGNOS and the like)"""
    STATUS_GBAS_FIX: _Final = 2
    """corrected by a station on the ground (DGPS, RTK)"""
    SERVICE_GPS: _Final = 1
    """bit of GPS"""
    SERVICE_GLONASS: _Final = 2
    """bit of GLONASS"""
    SERVICE_COMPASS: _Final = 4
    """bit of BeiDou, formerly Compass"""
    SERVICE_GALILEO: _Final = 8
    """bit of Galileo"""
    status: int
    """one of STATUS_..."""
    service: int
    """the systems in use: the sum of bits SERVICE_..."""
    def __init__(self, status: int | None = ..., service: int | None = ...) -> None: ...

class PointCloud(_base.Message):
    """Points with named values, in the older format. New interfaces use PointCloud2."""
    header: std_msgs.msg.Header
    """stamp: when the points were measured; frame_id: the frame of their coordinates"""
    points: list[geometry_msgs.msg.Point32]
    """metres"""
    channels: list[ChannelFloat32]
    """additional values, such as intensity; each channel has one value per point"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., points: list[geometry_msgs.msg.Point32] | None = ..., channels: list[ChannelFloat32] | None = ...) -> None: ...

class PointCloud2(_base.Message):
    """Points with any fields, as one block of bytes, from 3D lasers and depth cameras. sensor_msgs.point_cloud2
    reads and creates it. Ordered clouds keep the rows and columns of the sensor; others have a height of 1."""
    header: std_msgs.msg.Header
    """stamp: when the points were measured; frame_id: the frame of their coordinates"""
    height: int
    """rows; 1 for an unordered cloud"""
    width: int
    """points in a row; all points if height is 1"""
    fields: list[PointField]
    """the values of a point: usually x, y and z in metres, then intensity, rgb, ring, ..."""
    is_bigendian: bool
    """true if the most significant byte of a value is first"""
    point_step: int
    """bytes from one point to the next"""
    row_step: int
    """bytes from one row to the next"""
    @property
    def data(self) -> bytes:
        """the points: row_step times height bytes"""
    @data.setter
    def data(self, value: _types.Octets) -> None: ...
    is_dense: bool
    """true if every point is valid; false when some are NaN"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., height: int | None = ..., width: int | None = ..., fields: list[PointField] | None = ..., is_bigendian: bool | None = ..., point_step: int | None = ..., row_step: int | None = ..., data: _types.Octets | None = ..., is_dense: bool | None = ...) -> None: ...

class PointField(_base.Message):
    """Position and type of one value of a point in the bytes of a PointCloud2."""
    INT8: _Final = 1
    """1 byte, signed"""
    UINT8: _Final = 2
    """1 byte, unsigned"""
    INT16: _Final = 3
    """2 bytes, signed"""
    UINT16: _Final = 4
    """2 bytes, unsigned"""
    INT32: _Final = 5
    """4 bytes, signed"""
    UINT32: _Final = 6
    """4 bytes, unsigned"""
    FLOAT32: _Final = 7
    """floating point of 4 bytes"""
    FLOAT64: _Final = 8
    """floating point of 8 bytes"""
    name: str
    """x, y, z, intensity, rgb, ..."""
    offset: int
    """bytes from the beginning of the point"""
    datatype: int
    """one of the constants above"""
    count: int
    """number of consecutive values; usually 1"""
    def __init__(self, name: str | None = ..., offset: int | None = ..., datatype: int | None = ..., count: int | None = ...) -> None: ...

class Range(_base.Message):
    """One distance from an ultrasonic or infrared sensor: somewhere within a cone along x of the sensor frame,
    an object reflects at that distance."""
    ULTRASOUND: _Final = 0
    """sound"""
    INFRARED: _Final = 1
    """infrared light"""
    header: std_msgs.msg.Header
    """stamp: when the range was measured; frame_id: the sensor, which looks along its x axis"""
    radiation_type: int
    """ULTRASOUND or INFRARED"""
    field_of_view: float
    """full opening angle of the cone, radians"""
    min_range: float
    """shortest range that can be measured, metres; equal to max_range for a sensor that only detects"""
    max_range: float
    """longest range that can be measured, metres"""
    range: float
    """Metres; ignore values outside min_range and max_range. Sensors that only detect send -Inf for an object, and
    +Inf for none (REP 117)."""
    def __init__(self, header: std_msgs.msg.Header | None = ..., radiation_type: int | None = ..., field_of_view: float | None = ..., min_range: float | None = ..., max_range: float | None = ..., range: float | None = ...) -> None: ...

class RegionOfInterest(_base.Message):
    """A rectangle of an image. All zeros stand for the whole image."""
    x_offset: int
    """leftmost column, pixels; 0 at the left edge"""
    y_offset: int
    """topmost row, pixels; 0 at the upper edge"""
    height: int
    """rows, pixels"""
    width: int
    """columns, pixels"""
    do_rectify: bool
    """whether to rectify only this rectangle; usually false for the whole image"""
    def __init__(self, x_offset: int | None = ..., y_offset: int | None = ..., height: int | None = ..., width: int | None = ..., do_rectify: bool | None = ...) -> None: ...

class RelativeHumidity(_base.Message):
    """Relative humidity of the air."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: where the sensor is"""
    relative_humidity: float
    """from 0 (dry) to 1 (saturated), not a percentage"""
    variance: float
    """0: unknown"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., relative_humidity: float | None = ..., variance: float | None = ...) -> None: ...

class Temperature(_base.Message):
    """A temperature."""
    header: std_msgs.msg.Header
    """stamp: time of the measurement; frame_id: where the sensor is"""
    temperature: float
    """degrees Celsius"""
    variance: float
    """degrees Celsius squared; 0: unknown"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., temperature: float | None = ..., variance: float | None = ...) -> None: ...

class TimeReference(_base.Message):
    """The time of another clock, such as a GPS receiver's, and of this machine at the same moment."""
    header: std_msgs.msg.Header
    """stamp: time of this machine when the other clock was read; frame_id is not used"""
    time_ref: _time.Time
    """time of the other clock"""
    source: str
    """the other clock; may be empty"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., time_ref: _time.Time | None = ..., source: str | None = ...) -> None: ...
