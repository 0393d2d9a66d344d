"""Messages of geometry_msgs, made from their definitions by `pipros stubs`."""

from collections.abc import Sequence as _Sequence
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import std_msgs.msg

class Accel(_base.Message):
    """Acceleration of a body. The frame is specified by the enclosing message or the topic's documentation."""
    linear: Vector3
    """metres per second squared"""
    angular: Vector3
    """radians per second squared, about the axes x, y and z"""
    def __init__(self, linear: Vector3 | None = ..., angular: Vector3 | None = ...) -> None: ...

class AccelStamped(_base.Message):
    """An acceleration with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame along whose axes the components are given"""
    accel: Accel
    """linear and angular acceleration"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., accel: Accel | None = ...) -> None: ...

class AccelWithCovariance(_base.Message):
    """An acceleration and how certain it is."""
    accel: Accel
    """the estimate, linear and angular"""
    @property
    def covariance(self) -> _Sequence[float]:
        """6 by 6 matrix, row by row, in the order linear x, y, z, then angular x, y, z. SI units squared."""
    @covariance.setter
    def covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, accel: Accel | None = ..., covariance: _types.Array[float] | None = ...) -> None: ...

class AccelWithCovarianceStamped(_base.Message):
    """An estimated acceleration with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame along whose axes the components are given"""
    accel: AccelWithCovariance
    """the estimate and its covariance"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., accel: AccelWithCovariance | None = ...) -> None: ...

class Inertia(_base.Message):
    """Mass properties of a rigid body. As in URDF, the inertia is taken about the centre of mass, along the axes
    of the frame in use. The tensor is symmetric, so six of its nine entries suffice."""
    m: float
    """mass, kilograms"""
    com: Vector3
    """centre of mass, metres from the origin of the frame"""
    ixx: float
    """entry of the inertia tensor, kg m^2"""
    ixy: float
    """entry of the inertia tensor, kg m^2; also stands for yx"""
    ixz: float
    """entry of the inertia tensor, kg m^2; also stands for zx"""
    iyy: float
    """entry of the inertia tensor, kg m^2"""
    iyz: float
    """entry of the inertia tensor, kg m^2; also stands for zy"""
    izz: float
    """entry of the inertia tensor, kg m^2"""
    def __init__(self, m: float | None = ..., com: Vector3 | None = ..., ixx: float | None = ..., ixy: float | None = ..., ixz: float | None = ..., iyy: float | None = ..., iyz: float | None = ..., izz: float | None = ...) -> None: ...

class InertiaStamped(_base.Message):
    """Mass properties of a body, with their frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the centre of mass and the axes"""
    inertia: Inertia
    """mass, centre of mass and inertia tensor"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., inertia: Inertia | None = ...) -> None: ...

class Point(_base.Message):
    """A position. In the frame of a body, x points forward, y left and z up (REP 103)."""
    x: float
    """metres"""
    y: float
    """metres"""
    z: float
    """metres"""
    def __init__(self, x: float | None = ..., y: float | None = ..., z: float | None = ...) -> None: ...

class Point32(_base.Message):
    """A position in single precision, for long lists of points whose size matters. Otherwise, use Point."""
    x: float
    """metres"""
    y: float
    """metres"""
    z: float
    """metres"""
    def __init__(self, x: float | None = ..., y: float | None = ..., z: float | None = ...) -> None: ...

class PointStamped(_base.Message):
    """A position with its time and frame, so that tf2 can transform it to another frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame in which the coordinates are given"""
    point: Point
    """the position"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., point: Point | None = ...) -> None: ...

class Polygon(_base.Message):
    """A closed outline, such as the footprint of a robot. The last edge leads from the last point to the first."""
    points: list[Point32]
    """the corners in order, each once"""
    def __init__(self, points: list[Point32] | None = ...) -> None: ...

class PolygonStamped(_base.Message):
    """A closed outline with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the corners"""
    polygon: Polygon
    """the outline"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., polygon: Polygon | None = ...) -> None: ...

class Pose(_base.Message):
    """Position and orientation of a body. It contains no frame: use PoseStamped if the frame is not obvious."""
    position: Point
    """metres"""
    orientation: Quaternion
    """rotation of the body's axes relative to those of the frame; must have length 1"""
    def __init__(self, position: Point | None = ..., orientation: Quaternion | None = ...) -> None: ...

class Pose2D(_base.Message):
    """A pose on a plane. Kept for older interfaces; new ones use Pose or PoseStamped, which tf2 can transform."""
    x: float
    """metres"""
    y: float
    """metres"""
    theta: float
    """heading in radians, counter-clockwise from the x axis"""
    def __init__(self, x: float | None = ..., y: float | None = ..., theta: float | None = ...) -> None: ...

class PoseArray(_base.Message):
    """Many poses in one frame, such as the particles of a localization filter or candidates for a grasp."""
    header: std_msgs.msg.Header
    """time and frame of all poses"""
    poses: list[Pose]
    """any number, in no particular order"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., poses: list[Pose] | None = ...) -> None: ...

class PoseStamped(_base.Message):
    """A pose with its time and frame. Usual for navigation goals (move_base_simple/goal) and tracked objects."""
    header: std_msgs.msg.Header
    """frame_id: the frame in which the pose is given; stamp: the time of the pose"""
    pose: Pose
    """position and orientation"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: Pose | None = ...) -> None: ...

class PoseWithCovariance(_base.Message):
    """A pose and how certain it is."""
    pose: Pose
    """the estimate"""
    @property
    def covariance(self) -> _Sequence[float]:
        """6 by 6 matrix, row by row: x, y, z in metres, then rotations about the fixed axes x, y, z in radians. The
        diagonal contains the six variances. Some publishers use large values for unknown variances."""
    @covariance.setter
    def covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, pose: Pose | None = ..., covariance: _types.Array[float] | None = ...) -> None: ...

class PoseWithCovarianceStamped(_base.Message):
    """An estimated pose with its time and frame. Localization publishes amcl_pose, and subscribes to initialpose."""
    header: std_msgs.msg.Header
    """frame_id: the frame in which the pose is estimated, usually map"""
    pose: PoseWithCovariance
    """the estimate and its covariance"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: PoseWithCovariance | None = ...) -> None: ...

class Quaternion(_base.Message):
    """A rotation as a quaternion of length 1, with w last: (0, 0, 0, 1) is no rotation. A new message is all
    zeros, which is not a rotation: set w to 1 before you send it. For a yaw angle, z is sin(yaw/2), and w is
    cos(yaw/2)."""
    x: float
    """x of the axis, times the sine of half the angle"""
    y: float
    """y of the axis, times the sine of half the angle"""
    z: float
    """z of the axis, times the sine of half the angle"""
    w: float
    """the cosine of half the angle"""
    def __init__(self, x: float | None = ..., y: float | None = ..., z: float | None = ..., w: float | None = ...) -> None: ...

class QuaternionStamped(_base.Message):
    """A rotation with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame to which the rotation is relative"""
    quaternion: Quaternion
    """the rotation, of length 1"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., quaternion: Quaternion | None = ...) -> None: ...

class Transform(_base.Message):
    """The pose of a child frame in its parent frame. It converts coordinates in the child to coordinates in the
    parent: rotate first, then add the translation."""
    translation: Vector3
    """origin of the child in the parent, metres"""
    rotation: Quaternion
    """axes of the child in the parent; must have length 1"""
    def __init__(self, translation: Vector3 | None = ..., rotation: Quaternion | None = ...) -> None: ...

class TransformStamped(_base.Message):
    """The pose of a frame in its parent at a time. The tree of tf and tf2 consists of these transforms. A child
    has only one parent. Published on /tf, or once on /tf_static if it never changes."""
    header: std_msgs.msg.Header
    """frame_id: the parent frame; stamp: the time of the transform"""
    child_frame_id: str
    """the child frame; no leading slash"""
    transform: Transform
    """pose of the child in the parent"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., child_frame_id: str | None = ..., transform: Transform | None = ...) -> None: ...

class Twist(_base.Message):
    """Velocity of a body, measured or commanded. On cmd_vel, it is in the frame of the robot (base_link): linear.x
    is forward, linear.y to the left, and angular.z counter-clockwise; bases ignore components that they cannot
    follow."""
    linear: Vector3
    """metres per second"""
    angular: Vector3
    """radians per second, about the axes x, y and z"""
    def __init__(self, linear: Vector3 | None = ..., angular: Vector3 | None = ...) -> None: ...

class TwistStamped(_base.Message):
    """A velocity with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame along whose axes the components are given"""
    twist: Twist
    """linear and angular velocity"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., twist: Twist | None = ...) -> None: ...

class TwistWithCovariance(_base.Message):
    """A velocity and how certain it is."""
    twist: Twist
    """the estimate, linear and angular"""
    @property
    def covariance(self) -> _Sequence[float]:
        """6 by 6 matrix, row by row, in the order linear x, y, z, then angular x, y, z. SI units squared."""
    @covariance.setter
    def covariance(self, value: _types.Array[float]) -> None: ...
    def __init__(self, twist: Twist | None = ..., covariance: _types.Array[float] | None = ...) -> None: ...

class TwistWithCovarianceStamped(_base.Message):
    """An estimated velocity with its time and frame."""
    header: std_msgs.msg.Header
    """frame_id: the frame along whose axes the components are given"""
    twist: TwistWithCovariance
    """the estimate and its covariance"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., twist: TwistWithCovariance | None = ...) -> None: ...

class Vector3(_base.Message):
    """A vector without a position: a direction, velocity, force or offset, in the unit of the enclosing field.
    A transform rotates it, but does not translate it; for a position, use Point."""
    x: float
    """component along x"""
    y: float
    """component along y"""
    z: float
    """component along z"""
    def __init__(self, x: float | None = ..., y: float | None = ..., z: float | None = ...) -> None: ...

class Vector3Stamped(_base.Message):
    """A vector with its time and frame. A transform rotates it, but does not translate it."""
    header: std_msgs.msg.Header
    """frame_id: the frame along whose axes the components are given"""
    vector: Vector3
    """the vector, in the unit that the topic states"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., vector: Vector3 | None = ...) -> None: ...

class Wrench(_base.Message):
    """Force and torque on a body."""
    force: Vector3
    """newtons"""
    torque: Vector3
    """newton metres, about the axes x, y and z"""
    def __init__(self, force: Vector3 | None = ..., torque: Vector3 | None = ...) -> None: ...

class WrenchStamped(_base.Message):
    """Force and torque with their time and frame, such as the reading of a sensor at a wrist."""
    header: std_msgs.msg.Header
    """frame_id: the components are along its axes, and the force acts at its origin"""
    wrench: Wrench
    """force and torque"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., wrench: Wrench | None = ...) -> None: ...
