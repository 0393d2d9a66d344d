"""Print the results of `sensor_msgs.point_cloud2` for random clouds, to compare implementations.

Run as a script by either Python; prints a JSON list.
"""

import json
import random
import sys

from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}


def outcome(action):
    try:
        return repr(action())
    except Exception as error:
        return type(error).__name__


def random_cloud(rng):
    fields, end = [], 0
    for name in "xyzabc"[: rng.randint(0, 5)]:
        kind, count = rng.randint(1, 8), rng.choice([1, 1, 1, 2, 0])
        fields.append(PointField(name, end + rng.choice([0, 0, 1, 3]), kind, count))
        end = fields[-1].offset + SIZES[kind] * count
    if rng.random() < 0.3:
        rng.shuffle(fields)
    width, height, step = rng.randint(0, 4), rng.choice([0, 1, 1, 2]), end + rng.choice([0, 0, 4])
    row_step = step * width + rng.choice([0, 0, 8])
    length = max(0, row_step * height - rng.choice([0, 0, 0, 3]))
    data = bytes(rng.choice([0, 127, 192, 255, rng.randrange(256)]) for _ in range(length))
    is_bigendian = rng.random() < 0.3
    return PointCloud2(Header(), height, width, fields, is_bigendian, step, row_step, data, False)


def examine(rng):
    cloud = random_cloud(rng)
    names = rng.choice([None, None, ("x", "y"), ["z"], ["b", "a"], "xyz", ["q"]])
    place = (rng.randint(0, 3), rng.randint(0, 1))
    single = [field for field in cloud.fields if field.count == 1]
    points = [[rng.randint(0, 127) for _ in single] for _ in range(3)]
    return [
        outcome(lambda: list(point_cloud2.read_points(cloud, names))),
        outcome(lambda: list(point_cloud2.read_points(cloud, names, skip_nans=True))),
        outcome(lambda: list(point_cloud2.read_points(cloud, uvs=[place]))),
        # Genuine ROS returns wrong names if the fields are not in the order of their offsets.
        outcome(lambda: [tuple(point) for point in point_cloud2.read_points_list(cloud)]),
        outcome(lambda: point_cloud2.create_cloud(Header(), single, points)),
        outcome(lambda: point_cloud2.create_cloud_xyz32(Header(), [point[:3] for point in points])),
    ]


def examine_many(seed, count):
    rng = random.Random(seed)  # noqa: S311
    return [examine(rng) for _ in range(count)]


if __name__ == "__main__":
    json.dump(examine_many(seed=1, count=300), sys.stdout)
