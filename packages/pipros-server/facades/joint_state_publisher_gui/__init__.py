"""Replacement for Noetic's joint_state_publisher_gui, with the sliders on a web page."""

from __future__ import annotations

import logging
import random
from contextlib import ExitStack

import rospy
from joint_state_publisher import JointStatePublisher
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_server.node_page import served_page
from pipros_server.sliders.slider_page import Slider, SliderPage


class JointStatePublisherGui:
    """Web page for a JointStatePublisher, with a slider for each of its `free_joints`."""

    def __init__(self, title: str, jsp: JointStatePublisher) -> None:
        self.jsp = jsp
        buttons = {"Randomize": self.randomize, "Center": self.center}
        self.page = SliderPage(title, rospy.get_name(), self._sliders, self._move, buttons)

    def center(self) -> None:
        """Move each free joint to its zero position."""
        for joint in self.jsp.free_joints.values():
            joint["position"] = joint["zero"]

    def randomize(self) -> None:
        """Move each free joint to a random position within its range."""
        for joint in self.jsp.free_joints.values():
            joint["position"] = random.uniform(joint["min"], joint["max"])  # noqa: S311

    def _sliders(self) -> list[Slider]:
        return [
            Slider(name, joint["min"], joint["max"], joint.get("position", joint["zero"]))
            for name, joint in self.jsp.free_joints.items()
        ]

    def _move(self, name: str, value: float) -> None:
        self.jsp.free_joints[name]["position"] = value


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("joint_state_publisher_gui")
    try:
        publisher = JointStatePublisher()
    except RuntimeError as error:
        rospy.logfatal("joint_state_publisher_gui cannot start: %s", error)
        return 1
    page = JointStatePublisherGui("Joint State Publisher", publisher).page
    with ExitStack() as stack:
        stack.enter_context(served_page(page.served_views(), rospy.get_name(), logging.getLogger("rosout")))
        publisher.loop()
    return 0
