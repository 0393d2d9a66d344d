"""Generate unique goal IDs."""

from __future__ import annotations

from itertools import count

from actionlib_msgs.msg import GoalID

import rospy
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

_numbers = count(1)


class GoalIDGenerator:
    """Generates goal IDs from the node name, a process-wide counter and the time."""

    def __init__(self, name: str | None = None) -> None:
        self.set_name(rospy.get_name() if name is None else name)

    def set_name(self, name: str) -> None:
        """Set the prefix of the IDs."""
        self.name = name

    def generate_ID(self) -> GoalID:
        """Return a new goal ID, stamped with the current time."""
        now = rospy.Time.now()
        return GoalID(now, f"{self.name}-{next(_numbers)}-{now.secs}.{now.nsecs}")
