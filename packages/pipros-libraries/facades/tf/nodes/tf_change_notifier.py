"""`rosrun tf tf_change_notifier`: publish transforms on `tf_changes` when frames move."""

from __future__ import annotations

import sys

from tf2_msgs.msg import TFMessage

import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.transforms.change_filter import (
    BadFramePair,
    FramePair,
    distance_of,
    frame_pairs,
    frequency_of,
)
from pipros_libraries.transforms.messages import pose_of_transform
from tf.transformer import strip_leading_slash

_DEFAULT = [{"source_frame": "/base_link", "target_frame": "/map"}]


def pairs_of_parameters() -> list[FramePair]:
    """Read the frame pairs from the node's parameters.

    Raises:
        BadFramePair: a parameter is invalid.
    """
    bounds = [
        distance_of(name, rospy.get_param(f"~{name}", 0.1))
        for name in ("translational_update_distance", "angular_update_distance")
    ]
    return frame_pairs(rospy.get_param("~frame_pairs", _DEFAULT), *bounds)


def changes(pairs: list[FramePair], buffer: tf2_ros.Buffer) -> TFMessage:
    """Return the latest transform of each pair that has moved. Pairs without a transform are skipped."""
    message = TFMessage()
    for pair in pairs:
        target, source = strip_leading_slash(pair.target), strip_leading_slash(pair.source)
        try:
            found = buffer.lookup_transform(target, source, rospy.Time())
        except tf2_ros.TransformException as error:
            rospy.logdebug("%s", error)
            continue
        if pair.has_moved(pose_of_transform(found.transform)):
            # Frame IDs start with a slash, as in Noetic.
            found.header.frame_id, found.child_frame_id = f"/{target}", f"/{source}"
            message.transforms.append(found)
    return message


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("change_notifier", anonymous=True)
    try:
        hz = frequency_of("polling_frequency", rospy.get_param("~polling_frequency", 10.0))
        pairs = pairs_of_parameters()
    except BadFramePair as error:
        print(f"tf_change_notifier: error: {error}", file=sys.stderr)
        return 1
    for pair in pairs:
        rospy.loginfo(
            "Notifying change on %s -> %s "
            "(translational update distance: %.4f, angular update distance: %.4f)",
            *(pair.source, pair.target, pair.distance, pair.angle),
        )
    publisher = rospy.Publisher("tf_changes", TFMessage, queue_size=1)
    buffer = tf2_ros.Buffer(debug=False)
    listener = tf2_ros.TransformListener(buffer)
    rate = rospy.Rate(hz, reset=True)
    while not rospy.is_shutdown():
        message = changes(pairs, buffer)
        if message.transforms:
            publisher.publish(message)
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    listener.unregister()
    return 0
