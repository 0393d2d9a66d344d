#!/usr/bin/env python3
"""Monitor a simulated battery from 30 % to empty. Run it with `rostest vehicle_battery battery.test`."""

import sys
import threading
import unittest

import rospy
import rostest
from composiv_tryouts.msg import BatteryLevel
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from std_srvs.srv import Trigger
from vehicle_battery.msg import BatteryWarning

TIMEOUT_S = 40


class Battery(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_battery")

    def wait_for(self, topic, message_class, is_wanted):
        found, came = [], threading.Event()

        def check(message):
            if not found and is_wanted(message):
                found.append(message)
                came.set()

        subscriber = rospy.Subscriber(topic, message_class, check)
        self.addCleanup(subscriber.unregister)
        self.assertTrue(came.wait(TIMEOUT_S), f"no matching message arrived on {topic}")
        return found[0]

    def test_warns_and_is_acknowledged(self):
        Client("battery_monitor", timeout=TIMEOUT_S).update_configuration({"low": 0.9, "critical": 0.01})
        low = self.wait_for("battery_warning", BatteryWarning, lambda warning: warning.level == warning.LOW)
        self.assertIn("battery low", low.text)

        rospy.wait_for_service("battery_monitor/acknowledge", TIMEOUT_S)
        answer = rospy.ServiceProxy("battery_monitor/acknowledge", Trigger)()
        self.assertTrue(answer.success, answer.message)
        self.wait_for("battery_warning", BatteryWarning, lambda warning: warning.acknowledged)

    def test_reports_to_diagnostics(self):
        def is_wanted(array):
            return any(
                status.name == "battery_monitor: Battery" and status.level > 0 for status in array.status
            )

        self.wait_for("/diagnostics", DiagnosticArray, is_wanted)

    def test_publishes_the_level_like_the_case_study(self):
        level = self.wait_for("battery_topic", BatteryLevel, lambda level: level.battery.startswith("%"))
        self.assertTrue(0 <= int(level.battery[1:]) <= 100)


if __name__ == "__main__":
    rostest.rosrun("vehicle_battery", "battery", Battery, sys.argv)
