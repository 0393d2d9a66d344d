"""`DynamicAction`: the messages of an action by the name of its type."""

from __future__ import annotations

import sys
from typing import Any

import genpy
import rospy
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "roslib")


class DynamicAction:
    """The classes of an action such as `actionlib/TestAction`: `action`, `goal`, `feedback`, `result`.

    The process ends with an error in the log where one does not exist.
    """

    def __init__(self, name: str) -> None:
        if not name.endswith("Action"):
            raise AssertionError(f"the type of an action must end in Action, got {name}")
        self.name = name[: -len("Action")]
        self.action = self.load_submsg("Action")
        self.goal = self.load_submsg("Goal")
        self.feedback = self.load_submsg("Feedback")
        self.result = self.load_submsg("Result")

    def load_submsg(self, subname: str) -> Any:
        """The class of one of the messages, by the end of its name."""
        found = genpy.message.get_message_class(self.name + subname)
        if found is None:
            rospy.logfatal("Could not load message for: %s", self.name + subname)
            sys.exit(1)
        return found
