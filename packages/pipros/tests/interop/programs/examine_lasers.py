"""Print the results of laser_geometry and angles of either side for random scans and angles."""

from __future__ import annotations

import json
import math
import sys

import numpy as np
from sensor_msgs.msg import LaserScan

import angles
from laser_geometry import LaserProjection

rng = np.random.RandomState(int(sys.argv[1]))
found = {}


def scan_of(count):
    scan = LaserScan()
    scan.header.frame_id = "laser"
    scan.angle_min = float(rng.uniform(-3, 0))
    scan.angle_increment = float(rng.uniform(0.001, 0.1))
    scan.angle_max = scan.angle_min + count * scan.angle_increment
    scan.time_increment = float(rng.uniform(0, 0.001))
    scan.range_min, scan.range_max = float(rng.uniform(0, 1)), float(rng.choice([5.0, 30.0, math.inf]))
    values = rng.uniform(-1, 40, count)
    values[rng.random_sample(count) < 0.1] = math.nan
    values[rng.random_sample(count) < 0.1] = math.inf
    scan.ranges = values.astype("float32").astype(float).tolist()
    if rng.randint(2):
        scan.intensities = rng.uniform(0, 1000, count).astype("float32").astype(float).tolist()
    return scan


def cloud_as_list(cloud):
    fields = [[field.name, field.offset, field.datatype, field.count] for field in cloud.fields]
    layout = [cloud.height, cloud.width, cloud.point_step, cloud.row_step, cloud.is_bigendian, cloud.is_dense]
    return [cloud.header.frame_id, fields, layout, bytes(cloud.data).hex()]


for number in range(60):
    scan, projection = scan_of(int(rng.randint(0, 200))), LaserProjection()
    for options in (LaserProjection.ChannelOption.DEFAULT, int(rng.randint(32))):
        for cutoff in (-1.0, float(rng.uniform(0, 50))):
            cloud = projection.projectLaser(scan, cutoff, options)
            found[f"scan {number} {options} {cutoff}"] = cloud_as_list(cloud)
    found[f"scan {number}"] = cloud_as_list(projection.projectLaser(scan_of(9)))
scan.intensities = [1.0]
scan.ranges, scan.range_min, scan.range_max = [1.0, 1.0], 0.0, 9.0
try:
    LaserProjection().projectLaser(scan)
except IndexError:
    found["fewer intensities"] = "IndexError"

ROUND = [
    0.0, 0.25, -0.25, 0.5, -0.5, math.pi / 2, -math.pi / 2, math.pi, -math.pi, 2 * math.pi, -2 * math.pi, 9.0,
]  # fmt: skip
for _ in range(4000):
    values = [float(rng.choice(ROUND) if rng.randint(2) else rng.uniform(-10, 10)) for _ in range(4)]
    found[f"angles {values}"] = [
        *(function(values[0]) for function in (angles.normalize_angle, angles.normalize_angle_positive)),
        angles.two_pi_complement(values[0]),
        angles.shortest_angular_distance(*values[:2]),
        list(angles.shortest_angular_distance_with_limits(*values)),
        list(angles.shortest_angular_distance_with_large_limits(*values)),
    ]
print(json.dumps(found))
