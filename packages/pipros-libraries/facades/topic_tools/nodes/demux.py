"""`rosrun topic_tools demux`: republish a topic's messages on one selected topic."""

from __future__ import annotations

import threading

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.selection import Selection
from topic_tools.nodes.output import Input, Output, base_name
from topic_tools.nodes.switching import Services, selection_of

USAGE = "\nusage: demux IN_TOPIC OUT_TOPIC1 [OUT_TOPIC2 [...]]\n"

FIRST_SUBSCRIBER_S = 0.5
"""Maximum time that the first message waits for a subscriber of its newly advertised topic."""


class Demux:
    """Republisher of messages on the selected topic. All topics have the type of the first message."""

    def __init__(self, selection: Selection) -> None:
        self.selection = selection
        self._lock = threading.Lock()
        self._first: AnyMsg | None = None
        self._outputs = {topic: Output(topic) for topic in selection.topics}

    def pass_on(self, message: AnyMsg) -> None:
        with self._lock:
            first = self._first or message
            new = [item for item in self._outputs.values() if item.advertise_like(first, latch=False)]
            if new:
                self._first = first
            output = self._outputs.get(self.selection.selected)
        for item in new:
            rospy.loginfo("Added publisher %s to demux!", item.topic)
        if output is not None:
            if output in new:
                output.has_subscriber.wait(FIRST_SUBSCRIBER_S)
            output.publish(message)

    def select(self, topic: str) -> str:
        """Select an output, or none if `topic` is `__none`. Return the previous selection.

        Raises:
            BadSelection: `topic` is not an output of the demux.
        """
        rospy.loginfo("trying to switch demux to %s", topic)
        before = self.selection.select(topic)
        if self.selection.selected:
            rospy.loginfo("demux selected output: [%s]", topic)
        else:
            rospy.loginfo("demux selected to no output.")
        return before

    def add(self, topic: str) -> None:
        """Add an output, which is advertised when the next message arrives.

        Raises:
            BadSelection: `topic` is already an output of the demux, or not a valid name.
        """
        with self._lock:
            self.selection.add(topic)
            self._outputs[topic] = Output(topic)

    def delete(self, topic: str) -> None:
        """Remove an output.

        Raises:
            BadSelection: `topic` is not an output of the demux, or is currently selected.
        """
        with self._lock:
            self.selection.delete(topic)
            output = self._outputs.pop(topic)
        output.unregister()
        rospy.loginfo("deleted topic %s from demux", topic)


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) < 2:
        print(USAGE)
        return 1
    source, *targets = arguments
    rospy.init_node(f"{base_name(*arguments)}_demux", anonymous=True)
    selection = selection_of("demux", targets)
    demux = Demux(selection)
    services = Services("Demux", selection)

    services.announce()
    Input(source, demux.pass_on).subscribe()
    services.serve("Select", demux.select)
    services.serve("Add", demux.add)
    services.serve("Delete", demux.delete)
    services.serve_list()
    rospy.spin()
    return 0
