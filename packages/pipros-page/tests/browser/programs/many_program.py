"""2,000 markers and a cloud of 100,000 points, published again and again, for the Scene tab."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

import rospy

SIDE = 40


def marker(number: int) -> Marker:
    """Return a cube, sphere or cylinder in a grid, 0.2 m apart; one is a large red cube at (-6, 0)."""
    made = Marker(ns=("cubes", "spheres", "cylinders")[number % 3], id=number, type=1 + number % 3)
    made.header.frame_id = "map"
    made.pose.position.x, made.pose.position.y = number % SIDE * 0.2 - 4, number // SIDE * 0.2 - 5
    made.pose.orientation.w = 1.0
    made.scale.x = made.scale.y = made.scale.z = 0.1
    made.color.g = made.color.a = 1.0
    if number == 1998:
        made.pose.position.x, made.pose.position.y = -6.0, 0.0
        made.scale.x = made.scale.y = made.scale.z = 1.0
        made.color.r, made.color.g = 1.0, 0.0
    return made


def cloud() -> PointCloud2:
    """Return a square of 8 x 8 m around the origin, whose intensity is 0 where x < 0, and 1 elsewhere."""
    count = 100_000
    n = np.arange(count)
    x, y = n % 400 / 50 - 4, n // 400 / 31.25 - 4
    rows = np.stack([x, y, np.zeros(count), x >= 0], axis=1).astype("<f4")
    fields = [PointField(name, 4 * at, 7, 1) for at, name in enumerate(("x", "y", "z", "intensity"))]
    made = PointCloud2(height=1, width=count, point_step=16, row_step=16 * count, fields=fields)
    made.header.frame_id, made.data = "map", rows.tobytes()
    return made


rospy.init_node("many")
markers = rospy.Publisher("/many", MarkerArray, queue_size=1)
clouds = rospy.Publisher("/large", PointCloud2, queue_size=1)
array, points = MarkerArray([marker(number) for number in range(2000)]), cloud()
rate = rospy.Rate(2)
while not rospy.is_shutdown():
    if markers.get_num_connections():
        markers.publish(array)
    if clouds.get_num_connections():
        clouds.publish(points)
    rate.sleep()
