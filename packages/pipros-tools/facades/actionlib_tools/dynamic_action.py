"""`DynamicAction`, which finds the message classes of an action by its type name."""

from __future__ import annotations

import sys
from typing import Any

import genpy
import rospy
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "roslib")


class DynamicAction:
    """The message classes of an action such as `actionlib/TestAction`.

    If a class does not exist, an error is logged and SystemExit is raised, as in Noetic.

    Attributes:
        action, goal, feedback, result: the classes.
    """

    def __init__(self, name: str) -> None:
        if not name.endswith("Action"):
            raise AssertionError(f"action type must end in Action, got {name}")
        self.name = name[: -len("Action")]
        self.action = self.load_submsg("Action")
        self.goal = self.load_submsg("Goal")
        self.feedback = self.load_submsg("Feedback")
        self.result = self.load_submsg("Result")

    def load_submsg(self, subname: str) -> Any:
        """Load the action's message class for `subname`: `Action`, `Goal`, `Feedback` or `Result`.

        Exit with an error if the class does not exist.
        """
        found = genpy.message.get_message_class(self.name + subname)
        if found is None:
            rospy.logfatal("Could not load message for: %s", self.name + subname)
            sys.exit(1)
        return found
