"""Print as JSON the results of tf, tf2_geometry_msgs and tf2_sensor_msgs for random messages.

Arguments: a seed and a number of repetitions. Runs under either implementation, without a master.
"""

import json
import math
import random
import sys

from geometry_msgs.msg import (
    PointStamped,
    PoseStamped,
    QuaternionStamped,
    TransformStamped,
    Vector3Stamped,
    WrenchStamped,
)
from sensor_msgs.msg import PointCloud, PointField
from sensor_msgs.point_cloud2 import create_cloud, read_points
from std_msgs.msg import Header

import rospy
import tf
import tf2_geometry_msgs
import tf2_ros
import tf2_sensor_msgs


def plain(value):
    """Numbers and texts of messages, tuples and lists."""
    if hasattr(value, "__slots__"):
        return [plain(getattr(value, name)) for name in value.__slots__]
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value if isinstance(value, (str, bool, bytes)) or value is None else float(value)


def outcome(function, *arguments):
    try:
        return plain(function(*arguments))
    except Exception as error:
        return [type(error).__name__, str(error)]


def fill(draw, message):
    """Fill the numbers of a message randomly; normalise quaternions."""
    if message._type == "geometry_msgs/Quaternion":
        q = [draw.gauss(0, 1) for _ in range(4)]
        message.x, message.y, message.z, message.w = (x / math.sqrt(sum(y * y for y in q)) for x in q)
        return message
    for name, kind in zip(message.__slots__, message._slot_types):
        if kind == "float64":
            setattr(message, name, draw.uniform(-5, 5))
        elif "/" in kind and kind != "std_msgs/Header":
            fill(draw, getattr(message, name))
    return message


def examine(draw):
    transform = fill(
        draw, TransformStamped(header=Header(frame_id="to", stamp=rospy.Time(5)), child_frame_id="from")
    )
    for kind, function in (
        (PointStamped, tf2_geometry_msgs.do_transform_point),
        (Vector3Stamped, tf2_geometry_msgs.do_transform_vector3),
        (PoseStamped, tf2_geometry_msgs.do_transform_pose),
        (WrenchStamped, tf2_geometry_msgs.do_transform_wrench),
    ):
        message = fill(draw, kind(header=Header(frame_id="from", stamp=rospy.Time(3))))
        yield kind.__name__, outcome(function, message, transform)
        registered = tf2_ros.TransformRegistration().get(kind)
        yield "registered", registered is function
        yield "converted", outcome(tf2_ros.convert, message, kind)
    names = ["x", "y", "z", "intensity"]
    fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(names)]
    cloud = create_cloud(
        Header(frame_id="from"), fields, [[draw.uniform(-5, 5) for _ in names] for _ in range(5)]
    )
    moved = tf2_sensor_msgs.do_transform_cloud(cloud, transform)
    yield "cloud", [list(point) for point in read_points(moved)]
    yield (
        "cloud as a whole",
        plain(
            [
                moved.header, moved.height, moved.width, moved.fields, moved.point_step, moved.row_step,
                moved.is_dense,
            ]
        ),
    )  # fmt: skip

    transformer = tf.TransformerROS(True, rospy.Duration(10))
    frames = ["world", "base", "arm", "hand"]
    for parent, child in zip(frames, frames[1:]):
        for second in range(1, 6):
            sent = TransformStamped(
                header=Header(frame_id=parent, stamp=rospy.Time(100 + second)), child_frame_id=child
            )
            transformer.setTransform(fill(draw, sent))
    now = rospy.Time.from_sec(draw.uniform(101, 105))
    one, other = draw.choice(frames), draw.choice(frames + ["/hand", "nowhere"])
    header = Header(frame_id=other, stamp=now)
    for kind, name in (
        (PointStamped, "transformPoint"), (Vector3Stamped, "transformVector3"),
        (QuaternionStamped, "transformQuaternion"), (PoseStamped, "transformPose"),
    ):  # fmt: skip
        yield name, outcome(getattr(transformer, name), one, fill(draw, kind(header=header)))
        yield name + " not set", outcome(getattr(transformer, name), one, kind(header=header))
    points = [PointStamped().point for _ in range(3)]
    yield (
        "transformPointCloud",
        outcome(
            transformer.transformPointCloud,
            one,
            PointCloud(header=header, points=[fill(draw, point) for point in points]),
        ),
    )
    yield "asMatrix", outcome(lambda: transformer.asMatrix(one, header).tolist())
    yield "lookupTransform", outcome(transformer.lookupTransform, one, other, now)
    yield (
        "lookupTransformFull",
        outcome(transformer.lookupTransformFull, one, now, other, rospy.Time(103), "world"),
    )
    yield (
        "canTransform",
        [
            outcome(transformer.canTransform, one, other, now),
            outcome(transformer.canTransformFull, one, now, other, now, "base"),
        ],
    )
    yield "getLatestCommonTime", outcome(lambda: str(transformer.getLatestCommonTime(one, other)))
    yield (
        "frames",
        [
            outcome(transformer.getFrameStrings), outcome(transformer.frameExists, "hand"),
            outcome(transformer.frameExists, "world"), transformer.allFramesAsString(),
            transformer.allFramesAsDot(), transformer.allFramesAsDot(now),
        ],
    )  # fmt: skip
    yield "chain", outcome(transformer.chain, one, now, "hand", now, "base")
    yield (
        "lookupTwist",
        outcome(
            transformer.lookupTwist, "hand", "world", rospy.Time(draw.choice([0, 103])), rospy.Duration(0.5)
        ),
    )
    yield (
        "lookupTwistFull",
        outcome(
            *(transformer.lookupTwistFull, "arm", "world", "base", (0, 0, 0), "hand", rospy.Time(103)),
            rospy.Duration(1),
        ),
    )
    yield "waitForTransform", outcome(transformer.waitForTransform, one, other, now, rospy.Duration(1))
    transformer.setUsingDedicatedThread(True)
    yield (
        "waitForTransform not at all",
        outcome(transformer.waitForTransform, one, other, now, rospy.Duration(0)),
    )
    yield (
        "waitForTransformFull",
        outcome(transformer.waitForTransformFull, one, now, other, now, "base", rospy.Duration(0)),
    )
    transformer.clear()
    yield "cleared", outcome(transformer.lookupTransform, "hand", "base", now)
    yield "prefix", transformer.getTFPrefix()


def main():
    draw = random.Random(int(sys.argv[1]))  # noqa: S311 # no secret
    rospy.rostime.set_rostime_initialized(True)
    json.dump([answer for _ in range(int(sys.argv[2])) for answer in examine(draw)], sys.stdout)


if __name__ == "__main__":
    main()
