#!/usr/bin/env python3
"""The world of an errand: a driving base, a path service, and a path that becomes blocked."""

import threading

from move_base_msgs.msg import MoveBaseAction, MoveBaseResult
from std_msgs.msg import Bool
from std_srvs.srv import Trigger, TriggerResponse

import actionlib
import rospy

PLACES = ["1.0", "2.0", "-1.0", "100.0"]


class World:
    def __init__(self):
        self.places = iter(PLACES)
        self.clear = rospy.Publisher("clear", Bool, queue_size=1)
        self.server = actionlib.SimpleActionServer("move_base", MoveBaseAction, self.drive, auto_start=False)
        self.server.start()
        rospy.Service("where", Trigger, self.where)

    def where(self, _request):
        place = next(self.places, None)
        return TriggerResponse(place is not None, place or "nowhere left")

    def drive(self, goal):
        place = goal.target_pose.pose.position.x
        if place < 0:
            self.server.set_aborted(text="there is a wall")
        elif place < 10:
            self.server.set_succeeded(MoveBaseResult())
        else:
            cancelled = threading.Event()
            self.server.register_preempt_callback(cancelled.set)
            while not cancelled.wait(0.05) and not rospy.is_shutdown():
                self.clear.publish(False)
            self.server.set_preempted()


if __name__ == "__main__":
    rospy.init_node("world")
    World()
    rospy.spin()
