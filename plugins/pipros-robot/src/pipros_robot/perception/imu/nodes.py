"""The nodelet `imu_filter_madgwick/ImuFilterNodelet`, and the program `complementary_filter_node`."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.rate import Timer
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.inputs import SyncInput, synchronized
from pipros_libraries.nodes.params import number, private
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.transforms.messages import in_ns, vector_of
from pipros_libraries.transforms.pose import Vector, from_roll_pitch_yaw, roll_pitch_yaw
from pipros_robot.perception.imu.attitude import (
    WORLDS,
    Quaternion,
    inverse,
    orientation_at_rest,
    product,
    turned,
)
from pipros_robot.perception.imu.complementary import Complementary, Gains
from pipros_robot.perception.imu.madgwick import Madgwick

if TYPE_CHECKING:
    from geometry_msgs.msg import Quaternion as QuaternionMessage
    from geometry_msgs.msg import Vector3, Vector3Stamped
    from sensor_msgs.msg import Imu, MagneticField

QUEUE_SIZE: Final = 5
WAIT_NS: Final = 10 * NS_PER_S
"""Interval of warnings while there is no input."""

LARGEST: Final = 1e6
"""Measurements with larger components are dropped."""

LONGEST_S: Final = 10.0
"""If the time between two measurements is longer or negative, the second one is not integrated."""

GRAVITY: Final = 9.80665
SETTINGS: Final = (
    Setting("gain", 0.1, 0, 1, "weight of the correction by acceleration and magnetic field, rad/s"),
    Setting("zeta", 0.0, -1, 1, "weight of the correction of the gyroscope's drift, rad/s"),
    Setting("mag_bias_x", 0.0, -10, 10, "bias of the magnetometer, x component"),
    Setting("mag_bias_y", 0.0, -10, 10, "bias of the magnetometer, y component"),
    Setting("mag_bias_z", 0.0, -10, 10, "bias of the magnetometer, z component"),
    Setting("orientation_stddev", 0.0, 0, 10, "standard deviation of the orientation, rad"),
)


class _ImuNode:
    """Publishes `imu/data` from `imu/data_raw` and, with `~use_mag`, `imu/mag`."""

    def __init__(self, node: Node, *, use_mag: bool, publish_tf: bool) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        self._log, self._warnings, self._lock = node.log, Throttle(node.log, 5.0), threading.Lock()
        self._fixed_frame = private(node, "fixed_frame", "odom")
        self._is_reversed = private(node, "reverse_tf", False)
        self._constant_s = number(node, "constant_dt", 0.0)
        if self._constant_s < 0:
            self._log.warning("~constant_dt must be >= 0, got %g: using the timestamps", self._constant_s)
            self._constant_s = 0.0
        self._stddev = number(node, "orientation_stddev", 0.0)
        self._last_ns: int | None = None
        self._base, self._node = node.resolve("imu"), node
        self._output = self._advertise("data", "sensor_msgs/Imu")
        is_debugged = private(node, "publish_debug_topics", False)
        self._rpy = self._advertise("rpy/filtered", "geometry_msgs/Vector3Stamped") if is_debugged else None
        self._tf: Any = None
        if private(node, "publish_tf", publish_tf):
            self._tf = advertise(node, "/tf", "tf2_msgs/TFMessage", 100)
        self._uses_mag = private(node, "use_mag", use_mag)
        data, mag = f"{self._base}/data_raw", f"{self._base}/mag"
        if self._uses_mag:
            inputs = [SyncInput(data, "sensor_msgs/Imu"), SyncInput(mag, "sensor_msgs/MagneticField")]
            synchronized(node, inputs, self._receive, QUEUE_SIZE, is_exact=False)
        else:
            subscribe(node, data, "sensor_msgs/Imu", self._receive, QUEUE_SIZE)
        self._timer = Timer(node.clock, WAIT_NS, lambda _: self._warn_of_silence(), reset=True)

    def _advertise(self, name: str, kind: str) -> Any:
        return advertise(self._node, f"{self._base}/{name}", kind, QUEUE_SIZE)

    def _warn_of_silence(self) -> None:
        if self._last_ns is None:
            waits_for = f"{self._base}/data_raw{' and ' + self._base + '/mag' if self._uses_mag else ''}"
            self._log.warning("still waiting for data on %s", waits_for)

    def _receive(self, message: Imu, magnetic: MagneticField | None = None) -> None:
        with self._lock:
            self._on_imu(message, magnetic)

    def _on_imu(self, message: Imu, magnetic: MagneticField | None) -> None:
        rate, acceleration = vector_of(message.angular_velocity), vector_of(message.linear_acceleration)
        if not (_is_plausible(rate) and _is_plausible(acceleration)):
            self._warnings.warning("dropped a measurement: %s, %s", rate, acceleration)
            return
        field = vector_of(magnetic.magnetic_field) if magnetic is not None else None
        stamp_ns = in_ns(message.header.stamp)
        dt_s = (stamp_ns - (stamp_ns if self._last_ns is None else self._last_ns)) / NS_PER_S
        self._last_ns = stamp_ns
        dt_s = self._constant_s or (dt_s if 0 <= dt_s <= LONGEST_S else 0.0)
        found = self._estimate(rate, acceleration, field if field and _is_plausible(field) else None, dt_s)
        if found is not None:
            self._publish(message, found)

    def _publish(self, message: Imu, found: Quaternion) -> None:
        quaternion: type[QuaternionMessage] = load_message_class("geometry_msgs/Quaternion")
        filtered, variance = copy(message), self._stddev**2
        filtered.orientation = quaternion(*found)
        filtered.orientation_covariance = [variance * (index % 4 == 0) for index in range(9)]
        self._complete(filtered, found)
        self._output.publish(filtered)
        if self._rpy is not None:
            self._publish_rpy(self._rpy, message, found)
        if self._tf is not None:
            frames = self._fixed_frame, message.header.frame_id
            frame, child = frames[::-1] if self._is_reversed else frames
            one = stamped("geometry_msgs/TransformStamped", frame, message.header.stamp, child_frame_id=child)
            one.transform.rotation = quaternion(*(inverse(found) if self._is_reversed else found))
            self._tf.publish(load_message_class("tf2_msgs/TFMessage")([one]))

    def _publish_rpy(self, output: Any, message: Imu, found: Quaternion) -> None:
        vector: Vector3Stamped = load_message_class("geometry_msgs/Vector3Stamped")(header=message.header)
        vector.vector.x, vector.vector.y, vector.vector.z = roll_pitch_yaw((0.0, 0.0, 0.0, *found))
        output.publish(vector)

    def _estimate(
        self, rate: Vector, acceleration: Vector, field: Vector | None, dt_s: float
    ) -> Quaternion | None:
        """Update the filter. Return the orientation, or None before it is known."""
        raise NotImplementedError

    def _complete(self, filtered: Imu, found: Quaternion, /) -> None:
        """Change the other fields of a message that is published."""

    def close(self) -> None:
        """Stop the warnings."""
        self._timer.shutdown()


class MadgwickNode(_ImuNode):
    """The node of imu_filter_madgwick."""

    def __init__(self, node: Node) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        world = private(node, "world_frame", "enu")
        if world not in WORLDS:
            node.log.error("~world_frame must be enu, ned or nwu, got [%s]: using enu", world)
            world = "enu"
        self._world = WORLDS[world]
        self._is_stateless = private(node, "stateless", False)
        self._removes_gravity = private(node, "remove_gravity_vector", False)
        yaw = number(node, "yaw_offset", 0.0) - number(node, "declination", 0.0)
        self._offset = from_roll_pitch_yaw(0.0, 0.0, yaw)
        self._filter, self._bias = Madgwick(self._world), (0.0, 0.0, 0.0)
        self._raw_rpy: Any = None
        self._at_rest: Quaternion | None = None
        super().__init__(node, use_mag=True, publish_tf=True)
        if self._rpy is not None:
            self._raw_rpy = self._advertise("rpy/raw", "geometry_msgs/Vector3Stamped")
        self._settings = Reconfigurable(node, "~", SETTINGS, self._apply)

    def _apply(self, values: Mapping[str, Value], _level: int) -> None:
        v = {name: float(value) for name, value in values.items()}
        with self._lock:
            self._filter.gain, self._filter.zeta = v["gain"], v["zeta"]
            self._bias = v["mag_bias_x"], v["mag_bias_y"], v["mag_bias_z"]
            self._stddev = v["orientation_stddev"]

    def _estimate(
        self, rate: Vector, acceleration: Vector, field: Vector | None, dt_s: float
    ) -> Quaternion | None:
        if field is not None:
            x, y, z = (each - bias for each, bias in zip(field, self._bias, strict=True))
            field = x, y, z
            self._at_rest = orientation_at_rest(self._world, acceleration, field)
        if self._is_stateless or self._filter.orientation is None:
            is_blind = self._uses_mag and field is None
            if is_blind or not self._filter.start(acceleration, field):
                text = (
                    "cannot determine the orientation: no magnetic field, or acceleration or field too small"
                )
                self._warnings.warning(text)
                return None
        if not self._is_stateless:
            self._filter.update(rate, acceleration, field, dt_s)
        found = self._filter.orientation
        return found and product(self._offset, found)

    def _complete(self, filtered: Imu, found: Quaternion, /) -> None:
        if self._raw_rpy is not None and self._at_rest is not None:
            self._publish_rpy(self._raw_rpy, filtered, self._at_rest)
        if self._removes_gravity:
            gravity = turned(inverse(found), (0.0, 0.0, self._world.up * GRAVITY))
            x, y, z = vector_of(filtered.linear_acceleration)
            vector: type[Vector3] = load_message_class("geometry_msgs/Vector3")
            filtered.linear_acceleration = vector(x - gravity[0], y - gravity[1], z - gravity[2])


class ComplementaryNode(_ImuNode):
    """The node of imu_complementary_filter."""

    def __init__(self, node: Node) -> None:
        """Advertise and subscribe. Blocks until the master answers."""
        given: dict[str, Any] = {each.name: private(node, each.name, each.default) for each in fields(Gains)}
        for name in ("gain_acc", "gain_mag", "bias_alpha"):
            if not 0 <= given[name] <= 1:
                node.log.warning("~%s must be in [0, 1], got %g: using 0.01", name, given[name])
                given[name] = 0.01
        gains = Gains(**given)
        self._filter, self._removes_bias = Complementary(gains), gains.do_bias_estimation
        self._steady: Any = None
        super().__init__(node, use_mag=False, publish_tf=False)
        if self._rpy is not None and gains.do_bias_estimation:
            self._steady = self._advertise("steady_state", "std_msgs/Bool")

    def _estimate(
        self, rate: Vector, acceleration: Vector, field: Vector | None, dt_s: float
    ) -> Quaternion | None:
        self._filter.update(rate, acceleration, field, dt_s)
        return self._filter.orientation

    def _complete(self, filtered: Imu, _found: Quaternion, /) -> None:
        if self._removes_bias:
            rates = zip(vector_of(filtered.angular_velocity), self._filter.bias, strict=True)
            vector: type[Vector3] = load_message_class("geometry_msgs/Vector3")
            filtered.angular_velocity = vector(*(rate - bias for rate, bias in rates))
        if self._steady is not None:
            self._steady.publish(load_message_class("std_msgs/Bool")(self._filter.is_steady))


def _is_plausible(vector: Vector) -> bool:
    return all(math.isfinite(each) and abs(each) <= LARGEST for each in vector)


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `complementary_filter_node` until the node is shut down."""
    with roscpp_program("ComplementaryFilterROS", "imu_complementary_filter", argv) as (node, _):
        ComplementaryNode(node)
        node.wait_for_shutdown()
    return 0
