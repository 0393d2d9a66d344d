#!/usr/bin/env python3
"""Call the C++ service to add numbers, and report each water level with the sum and the path of rospy."""

from mixed.msg import Level
from mixed.srv import Add
from std_msgs.msg import String

import rospy


def main() -> None:
    rospy.init_node("listener")
    rospy.wait_for_service("add")
    total = rospy.ServiceProxy("add", Add)(3, 4).sum
    reports = rospy.Publisher("report", String, queue_size=10)

    def report(level: Level) -> None:
        reports.publish(f"{level.tank} {level.height} {total} {rospy.__file__}")

    rospy.Subscriber("level", Level, report)
    rospy.spin()


if __name__ == "__main__":
    main()
