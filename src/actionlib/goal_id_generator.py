"""Names of goals that no other goal has."""

from __future__ import annotations

from itertools import count

from actionlib_msgs.msg import GoalID

import rospy
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

_numbers = count(1)


class GoalIDGenerator:
    """Makes ids of the name of a node, a number that counts in the whole process, and the time."""

    def __init__(self, name: str | None = None) -> None:
        self.set_name(rospy.get_name() if name is None else name)

    def set_name(self, name: str) -> None:
        """The name that ids begin with."""
        self.name = name

    def generate_ID(self) -> GoalID:
        """A new id, with the current time as its stamp."""
        now = rospy.Time.now()
        return GoalID(now, f"{self.name}-{next(_numbers)}-{now.secs}.{now.nsecs}")
