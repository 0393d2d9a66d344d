"""`rosrun tf2_tools echo.py`: print the transform between two frames."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.transforms.formatting import pose_as_text
from pipros_libraries.transforms.messages import pose_of_transform


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("echo.py", description="Print the transform between two frames.")
    parser.add_argument("source_frame")
    parser.add_argument("target_frame")
    parser.add_argument("-r", "--rate", type=float, default=1.0, help="lookups per second, > 0 (default: 1)")
    parser.add_argument(
        "-c", "--cache_time", type=float, default=10.0, help="length of the buffer in seconds (default: 10)"
    )
    parser.add_argument(
        "-o",
        "--offset",
        type=float,
        help="look up at the current time plus this offset in seconds; ignored with -t",
    )
    parser.add_argument("-t", "--time", type=float, help="look up at this time in seconds")
    parser.add_argument("-l", "--limit", type=int, help="exit after this many lookups")
    parser.add_argument(
        "-p", "--precision", type=int, default=3, help="digits after the decimal point (default: 3)"
    )
    options = parser.parse_args(arguments)
    if not 0.0 < options.rate < math.inf:
        parser.error(f"the rate must be a finite number > 0, got {options.rate}")
    if not 0 <= options.precision <= 50:
        parser.error(f"the precision must be from 0 to 50, got {options.precision}")
    if not 0.0 < options.cache_time < 2**31:
        parser.error(f"the cache time must be > 0 and < 2^31 seconds, got {options.cache_time}")
    return options


def _echo(buffer: tf2_ros.Buffer, options: argparse.Namespace) -> None:
    """Print the transform at the time that the options specify."""
    now = rospy.Time.now()
    time = rospy.Time()
    if options.time is not None:
        time = rospy.Time.from_sec(options.time)
    elif options.offset is not None:
        time = now + rospy.Duration.from_sec(options.offset)
    at = f"(current time {now.to_sec()})"
    try:
        found = buffer.lookup_transform(options.source_frame, options.target_frame, time)
    except tf2_ros.TransformException as error:
        rospy.logerr("At time %s, %s %s", time.to_sec(), at, error)
    else:
        print(f"At time {found.header.stamp.to_sec()}, {at}")
        print(pose_as_text(pose_of_transform(found.transform), options.precision), flush=True)


@exits_after_ctrl_c()
def main() -> int:
    """Print transforms until the node is shut down or the limit is reached. Return the exit code."""
    options = _options(rospy.myargv()[1:])
    rospy.init_node("echo", anonymous=True)
    buffer = tf2_ros.Buffer(rospy.Duration.from_sec(options.cache_time), debug=False)
    listener = tf2_ros.TransformListener(buffer)
    left = math.inf if options.limit is None else options.limit
    rate = rospy.Rate(options.rate, reset=True)
    while left > 0 and not rospy.is_shutdown():
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
        _echo(buffer, options)
        left -= 1
    listener.unregister()
    return 0
