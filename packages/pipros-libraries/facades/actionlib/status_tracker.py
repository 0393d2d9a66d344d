"""The server's record of a goal."""

from __future__ import annotations

from typing import Any

from actionlib_msgs.msg import GoalStatus

import rospy
from actionlib.goal_id_generator import GoalIDGenerator
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "actionlib.goal_id_generator actionlib_msgs")


class StatusTracker:
    """A goal and its status.

    Args:
        goal_id, status: the ID and status of a goal that was cancelled before it was received.
        goal: the ActionGoal message of a received goal. A missing ID or stamp is filled in.

    Attributes:
        epoch: number of times the clock had moved back before the goal arrived.
    """

    def __init__(self, goal_id: Any = None, status: Any = None, goal: Any = None) -> None:
        self.goal: Any = None
        self.epoch = 0
        self.handle_tracker: Any = None
        self.status = GoalStatus()
        self.handle_destruction_time = rospy.Time()
        self.id_generator = GoalIDGenerator()
        if goal_id:
            self.status.goal_id, self.status.status = goal_id, status
            return
        self.goal = goal
        self.status.goal_id, self.status.status = goal.goal_id, GoalStatus.PENDING
        if not self.status.goal_id.id:
            self.status.goal_id = self.id_generator.generate_ID()
        if self.status.goal_id.stamp.is_zero():
            self.status.goal_id.stamp = rospy.Time.now()
