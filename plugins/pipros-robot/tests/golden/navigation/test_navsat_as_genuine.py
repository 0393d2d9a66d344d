"""navsat_transform_node on recorded messages, beside what the genuine node answered."""

import math
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_libraries.transforms.pose import Pose, from_roll_pitch_yaw
from tests.support.both_navigation import SIDES, BothNodes, both_nodes
from tests.support.drives import stamp
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LIMIT = 1e-6
REMAPS = [f"{name}:=/{name}" for name in ("gps/fix", "imu/data", "odometry/filtered")]
REMAPS.append("/tf_static:=tf_static")
PLACES = {
    "Berlin": (52.52, 13.405, 34.0),
    "Sydney": (-33.8568, 151.2153, 12.0),
    "Bergen": (60.39, 5.32, 20.0),  # an exception of the zones
    "the south pole": (-89.99, 37.0, 2800.0),
}


def fill(pose: Any, numbers: Pose) -> None:
    place, turn = pose.position, pose.orientation
    place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w = numbers


def odometry(time_s: float, pose: Pose) -> Any:
    made: Any = load_message_class("nav_msgs/Odometry")(child_frame_id="base_link")
    made.header.frame_id, made.header.stamp = "odom", stamp(time_s)
    fill(made.pose.pose, pose)
    made.pose.covariance = [0.01 * (1 + i % 7) if i % 7 in (0, 1, 6) else 0.002 for i in range(36)]
    return made


def fix(time_s: float, position: tuple[float, float, float], *, status: int = 0, frame: str = "gps") -> Any:
    made: Any = load_message_class("sensor_msgs/NavSatFix")()
    made.header.frame_id, made.header.stamp = frame, stamp(time_s)
    made.latitude, made.longitude, made.altitude = position
    made.status.status = status
    made.position_covariance = [1.0, 0.2, 0.1, 0.2, 2.0, 0.3, 0.1, 0.3, 4.0]
    return made


def imu(time_s: float, roll: float, pitch: float, yaw: float) -> Any:
    made: Any = load_message_class("sensor_msgs/Imu")()
    made.header.frame_id, made.header.stamp = "imu", stamp(time_s)
    turn = made.orientation
    turn.x, turn.y, turn.z, turn.w = from_roll_pitch_yaw(roll, pitch, yaw)
    return made


def numbers(message: Any) -> list[float]:
    """Return all numbers in a message."""
    if isinstance(message, int | float):
        return [float(message)]
    if isinstance(message, str):
        return []
    if isinstance(message, list | tuple):
        return [number for each in message for number in numbers(each)]
    if hasattr(message, "to_sec"):
        return [message.to_sec()]
    return [
        number for name in message.__slots__ if name != "seq" for number in numbers(getattr(message, name))
    ]


def assert_same(one: Any, other: Any, tolerance: float = LIMIT) -> None:
    assert numbers(one) == pytest.approx(numbers(other), abs=tolerance, rel=0)


def point(x: float, y: float, z: float) -> Any:
    made: Any = load_message_class("geometry_msgs/Point")
    return made(x, y, z)


def near(place: tuple[float, float, float], metres: float) -> Any:
    """Return a geographic position some metres away."""
    made: Any = load_message_class("geographic_msgs/GeoPoint")
    part = metres / 111_000.0
    return made(
        place[0] + part,
        place[1] + part / max(0.1, math.cos(math.radians(place[0]))),
        place[2] + metres / 50.0,
    )


class Receiver:
    """Feeds the node with the messages of a receiver, an imu and a filter."""

    def __init__(self, both: BothNodes) -> None:
        self.both = both
        self.positions = both.inboxes("odometry/gps", "nav_msgs/Odometry")
        self.filtered = both.inboxes("gps/filtered", "sensor_msgs/NavSatFix")
        self.tf = both.inboxes("tf_static", "tf2_msgs/TFMessage")
        self.has_frames = False  # the mountings of receiver and imu, and the pose of the robot

    def start(self, place: tuple[float, float, float], *, imu_is_used: bool = True) -> None:
        """Repeat the first messages until the node knows the transform, as the genuine one did."""
        if not self.has_frames:
            self.both.publish_next("tf_static", to="/pipros/", subscribers=2)
            self.has_frames = True

        def is_known() -> Any:
            self.both.publish("odometry/filtered", odometry(1.0, START))
            self.both.publish("gps/fix", fix(1.0, place))
            if imu_is_used:
                self.both.publish("imu/data", imu(1.0, 0.1, -0.05, 0.8), subscribers=0)
            return (
                self.both.try_call("toLL", "robot_localization/ToLL", map_point=point(0.0, 0.0, 0.0))
                is not None
            )

        wait_until(is_known, 60, lambda: str(self.both.output))

    def drive(self, place: tuple[float, float, float]) -> list[tuple[Any, Any]]:
        """Publish some fixes and poses; return the positions of both nodes."""
        found = []
        for index in range(1, 4):
            time_s = 1.0 + index
            given = near(place, 10.0 * index)
            self.both.publish("gps/fix", fix(time_s, (given.latitude, given.longitude, given.altitude)))

            def arrived(side: str, time_s: float = time_s) -> Any:
                messages = self.positions[side].messages
                return next((each for each in messages if each.header.stamp == stamp(time_s)), None)

            def both_arrived(time_s: float = time_s) -> bool:
                # A position needs a pose that is new: the cycle before the fix may have used the last one.
                self.both.publish("odometry/filtered", odometry(time_s, START))
                return bool(arrived("pipros", time_s))

            wait_until(both_arrived, 60, lambda: f"{time_s}: {self.both.output}")  # noqa: B023
            found.append((arrived("pipros"), arrived("genuine")))
        return found

    def sent(self, side: str) -> Any:
        """Return the transform that a node has sent; the others are those of `frames`."""

        def found() -> Any:
            sent = [each for message in self.tf[side].messages for each in message.transforms]
            return next(
                (each for each in sent if "base_link" not in (each.header.frame_id, each.child_frame_id)),
                None,
            )

        return wait_until(found, 30, lambda: str(self.both.output))

    def conversions(self, place: tuple[float, float, float]) -> list[list[Any]]:
        """Return the responses of both nodes to requests for conversions."""
        to = [
            self.both.call("toLL", "robot_localization/ToLL", map_point=point(*given))
            for given in ((0.0, 0.0, 0.0), (1200.0, -345.0, 7.0), (-4.0, 99.0, -3.0))
        ]
        back = [
            self.both.call("fromLL", "robot_localization/FromLL", ll_point=near(place, metres))
            for metres in (0.0, 50.0, -700.0)
        ]
        return [*to, *back]


START: Pose = (3.0, 1.0, 0.5, *from_roll_pitch_yaw(0.05, 0.1, 0.3))
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "heading of an imu": ("Berlin", {"magnetic_declination_radians": 0.07, "yaw_offset": 0.1}),
    "an exception of the zones": (
        "Bergen",
        {
            "publish_filtered_gps": True, "broadcast_cartesian_transform": True,
            "broadcast_cartesian_transform_as_parent_frame": True,
        },
    ),
    "south, flat": (
        "Sydney",
        {"zero_altitude": True, "broadcast_cartesian_transform": True, "use_odometry_yaw": True},
    ),
    "polar grid": ("the south pole", {}),
    "local plane": (
        "Berlin",
        {
            "use_local_cartesian": True, "broadcast_cartesian_transform": True, "publish_filtered_gps": True,
            "cartesian_frame_id": "plane",
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_positions_are_the_same(ros: RosSystem, recording: Recording, case: str) -> None:
    name, parameters = CASES[case]
    place = PLACES[name]
    given = {"frequency": 50.0, "transform_timeout": 1.0, **parameters}
    with both_nodes(
        ros, recording, "robot_localization", "navsat_transform_node", given, remaps=REMAPS
    ) as both:
        receiver = Receiver(both)
        receiver.start(place, imu_is_used=not parameters.get("use_odometry_yaw"))
        pairs = receiver.drive(place)
        responses = receiver.conversions(place)
        if parameters.get("publish_filtered_gps"):
            fixes = [receiver.filtered[side].wait()[-1] for side in SIDES]
            assert_same(*fixes)
        if parameters.get("broadcast_cartesian_transform"):
            one, other = (receiver.sent(side) for side in SIDES)
            assert (one.header.frame_id, one.child_frame_id) == (other.header.frame_id, other.child_frame_id)
            assert_same(one.transform, other.transform)

    for one, other in pairs:
        assert (one.header.frame_id, one.child_frame_id) == (other.header.frame_id, other.child_frame_id)
        assert_same(one, other)
    for one, other in responses:
        assert_same(one, other)


def test_interfaces_are_the_same(ros: RosSystem, recording: Recording) -> None:
    given = {"publish_filtered_gps": True, "broadcast_cartesian_transform": True}
    with both_nodes(
        ros, recording, "robot_localization", "navsat_transform_node", given, remaps=REMAPS
    ) as both:
        wait_until(
            lambda: both.interface("pipros") == both.interface("genuine"),
            60,
            lambda: str([both.interface(side) for side in SIDES]),
        )


def test_a_datum_and_a_zone_have_the_same_effects(ros: RosSystem, recording: Recording) -> None:
    given = {"wait_for_datum": True, "datum": [52.52, 13.405, 0.4], "frequency": 50.0}
    with both_nodes(
        ros, recording, "robot_localization", "navsat_transform_node", given, remaps=REMAPS
    ) as both:
        receiver = Receiver(both)
        receiver.start(PLACES["Berlin"], imu_is_used=False)
        first = receiver.conversions(PLACES["Berlin"])
        pairs = receiver.drive(PLACES["Berlin"])
        other: Any = load_message_class("geographic_msgs/GeoPose")()
        other.position.latitude, other.position.longitude, other.position.altitude = PLACES["Sydney"]
        other.orientation.z, other.orientation.w = math.sin(0.3), math.cos(0.3)
        both.call("datum", "robot_localization/SetDatum", geo_pose=other)
        receiver.start(PLACES["Berlin"], imu_is_used=False)
        second = receiver.conversions(PLACES["Sydney"])
        both.call("setUTMZone", "robot_localization/SetUTMZone", utm_zone="55H")
        # Both know the pose at the datum, and would use it if the next fix came before the next pose.
        both.publish("odometry/filtered", odometry(1.0, START))
        both.settle("toLL", "robot_localization/ToLL")
        receiver.start(PLACES["Sydney"], imu_is_used=False)
        third = receiver.conversions(PLACES["Sydney"])

    for one, another in [*first, *second, *third, *pairs]:
        assert_same(one, another)


def test_a_receiver_at_an_unknown_place_and_bad_fixes(ros: RosSystem, recording: Recording) -> None:
    given = {"frequency": 50.0, "use_odometry_yaw": True}
    with both_nodes(
        ros, recording, "robot_localization", "navsat_transform_node", given, remaps=REMAPS
    ) as both:
        receiver = Receiver(both)
        receiver.start(PLACES["Berlin"], imu_is_used=False)
        for index, made in enumerate(
            (
                fix(3.0, PLACES["Berlin"], frame="nowhere"),
                fix(4.0, PLACES["Berlin"], status=-1),
                fix(5.0, (math.nan, 0.0, 0.0)),
                fix(6.0, PLACES["Berlin"]),
            )
        ):
            both.publish("odometry/filtered", odometry(3.0 + index, START))
            both.publish("gps/fix", made)
            if index in (0, 3):
                wait_until(
                    lambda: any(
                        each.header.stamp == made.header.stamp  # noqa: B023
                        for each in receiver.positions["pipros"].messages
                    ),
                    30,
                    lambda: str(both.output),
                )
        stamps = [[each.header.stamp for each in receiver.positions[side].messages] for side in SIDES]
        last = [
            next(each for each in receiver.positions[side].messages if each.header.stamp == stamp(3.0))
            for side in SIDES
        ]

    assert_same(*last)
    assert all(stamp(4.0) not in found and stamp(5.0) not in found for found in stamps)
