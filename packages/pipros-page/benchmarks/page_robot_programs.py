"""Nodes of the robot that `script/bench page_robot` shows: `page_robot_programs.py ROLE`.

robot: tf at 50 Hz, a scan, a cloud of 20,000 points, a map, a path, odometry, an imu and 30 markers.
cameras: two images of 640 x 480 at 10 Hz. logger: 300 log entries a second, and a subscriber with a wrong
type. others: diagnostics, a service, dynamic_reconfigure, and a subscriber to a topic with a wrong name.
markers: 2,000 cubes, spheres and cylinders ten times a second. cloud: 1,000,000 points ten times a second.
"""

import itertools
import math
import sys
from io import BytesIO

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from sensor_msgs.msg import Image, Imu, LaserScan, PointCloud2, PointField
from std_msgs.msg import Float32, Float64
from std_srvs.srv import Trigger, TriggerResponse
from visualization_msgs.msg import Marker, MarkerArray

import rospy
import tf2_ros

FIELDS = [
    PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate(("x", "y", "z", "intensity"))
]


def stamped(message, frame="map"):
    message.header.frame_id, message.header.stamp = frame, rospy.Time.now()
    return message


def cloud_of(count):
    """Return a wavy square of points with intensities, 16 bytes each."""
    side = int(math.sqrt(count))
    n = np.arange(count)
    x, y = (n % side) / side * 10 - 5, (n // side) / side * 10 - 5
    columns = np.stack([x, y, np.sin(x) * np.cos(y), n % 97], axis=1).astype("<f4")
    return PointCloud2(
        height=1,
        width=count,
        fields=FIELDS,
        point_step=16,
        row_step=16 * count,
        data=columns.tobytes(),
        is_dense=True,
    )


def markers_of(count, moment, radius=4.0):
    """Return cubes, spheres and cylinders in a moving grid."""
    side = math.ceil(math.sqrt(count))
    found = []
    for n in range(count):
        marker = Marker(ns="obstacles", id=n, type=1 + n % 3, action=Marker.ADD)
        marker.header.frame_id = "map"  # without a stamp: at the newest pose of the frame
        marker.pose.position.x = (n % side) / side * 2 * radius - radius
        marker.pose.position.y = (n // side) / side * 2 * radius - radius
        marker.pose.position.z = 0.2 * math.sin(moment + n)
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = marker.scale.z = 0.1
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = (n % 7) / 7, 0.6, (n % 5) / 5, 1.0
        found.append(marker)
    return MarkerArray(markers=found)


def frames_of(moment):
    found = []
    for child, parent in [("odom", "map"), ("base", "odom")] + [(f"link{n}", "base") for n in range(20)]:
        each = stamped(TransformStamped(child_frame_id=child), parent)
        each.transform.translation.x = math.sin(moment) if child == "base" else 0.1 * len(child)
        each.transform.rotation.w = 1.0
        found.append(each)
    return found


def robot():
    topics = {
        "/scan": (LaserScan, 10),
        "/points": (PointCloud2, 10),
        "/path": (Path, 1),
        "/odom": (Odometry, 30),
        "/imu": (Imu, 100),
        "/markers": (MarkerArray, 2),
    }
    out = {name: rospy.Publisher(name, kind, queue_size=5) for name, (kind, _) in topics.items()}
    ground = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
    grid = stamped(OccupancyGrid(data=[0, 100, -1, 0] * 10_000))
    grid.info.width = grid.info.height = 200
    grid.info.resolution = 0.05
    ground.publish(grid)
    frames = tf2_ros.TransformBroadcaster()
    cloud, scan = cloud_of(20_000), LaserScan(range_max=9.0, angle_increment=0.0087, ranges=[3.0] * 720)
    path = stamped(Path(poses=[stamped(PoseStamped()) for _ in range(200)]))
    made = {
        "/scan": lambda _: stamped(scan, "base"),
        "/points": lambda _: stamped(cloud),
        "/path": lambda _: stamped(path),
        "/odom": lambda _: stamped(Odometry(), "odom"),
        "/imu": lambda _: stamped(Imu(), "base"),
        "/markers": lambda moment: markers_of(30, moment, 1.0),
    }
    for name, (_, hz) in topics.items():
        publish = out[name].publish
        rospy.Timer(rospy.Duration(1 / hz), lambda _, n=name, p=publish: p(made[n](rospy.get_time())))
    rospy.Timer(rospy.Duration(1 / 50), lambda _: frames.sendTransform(frames_of(rospy.get_time())))


def cameras():
    for side in ("left", "right"):
        out = rospy.Publisher(f"/{side}/image_raw", Image, queue_size=1)
        image = Image(width=640, height=480, step=1920, encoding="rgb8", data=bytes(range(256)) * 3600)
        rospy.Timer(rospy.Duration(0.1), lambda _, o=out, i=image: o.publish(stamped(i)))


def logger():
    voltage = rospy.Publisher("/battery_voltage", Float64, queue_size=1)
    rospy.Timer(rospy.Duration(0.1), lambda _: voltage.publish(12.5))
    rospy.Timer(rospy.Duration(1 / 300), lambda _: rospy.loginfo("loop %s", rospy.get_time()))
    rospy.Subscriber("/battery_voltage", Float32, lambda _: None)


def others():
    out = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
    states = [
        DiagnosticStatus(name=f"part {n}", level=n % 3, message="state", values=[KeyValue("key", str(n))])
        for n in range(20)
    ]
    rospy.Timer(rospy.Duration(1), lambda _: out.publish(stamped(DiagnosticArray(status=states))))
    rospy.Service("/reset", Trigger, lambda _: TriggerResponse(success=True))
    rospy.Subscriber("/left/image_rect", Image, lambda _: None)


class Serialized(MarkerArray):
    """A message serialized in advance, because doing so ten times a second would take a whole processor."""

    def serialize(self, buff):
        buff.write(self.body)


def markers():
    out = rospy.Publisher("/many", MarkerArray, queue_size=1)
    made = []
    for step in range(10):
        message, buffer = Serialized(), BytesIO()
        markers_of(2000, step * 0.3).serialize(buffer)
        message.body = buffer.getvalue()
        made.append(message)
    steps = itertools.cycle(made)
    rospy.Timer(rospy.Duration(0.1), lambda _: out.publish(next(steps)))


def cloud():
    out = rospy.Publisher("/million", PointCloud2, queue_size=1)
    made = cloud_of(1_000_000)
    rospy.Timer(rospy.Duration(0.1), lambda _: out.publish(stamped(made)))


if __name__ == "__main__":
    role = sys.argv[1]
    rospy.init_node(role)
    globals()[role]()
    rospy.spin()
