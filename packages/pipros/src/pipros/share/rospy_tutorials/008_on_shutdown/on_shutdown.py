#!/usr/bin/env python3
"""Ends by itself after a second, and calls functions at the end: a method and a function."""

import rospy


def say_goodbye() -> None:
    print("goodbye", flush=True)


class Motor:
    """Stands for hardware that must stop when the node ends."""

    def stop(self) -> None:
        print("the motor stops", flush=True)


if __name__ == "__main__":
    rospy.init_node("on_shutdown", anonymous=True)
    rospy.on_shutdown(say_goodbye)
    rospy.on_shutdown(Motor().stop)
    rospy.sleep(1.0)
    rospy.signal_shutdown("the work is done")
