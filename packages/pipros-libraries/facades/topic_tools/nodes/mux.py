"""`rosrun topic_tools mux`: republish messages from one selected topic."""

from __future__ import annotations

import threading

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.selection import NONE, BadSelection, Selection
from rospy.rostime import wallsleep
from topic_tools.nodes.output import Input, Output, base_name
from topic_tools.nodes.switching import Services, selection_of

USAGE = "\nusage: mux OUT_TOPIC IN_TOPIC1 [IN_TOPIC2 [...]]\n"


class Mux:
    """Republisher of messages from the selected topic.

    It subscribes to all inputs until the first message has determined the type. Afterwards, in lazy mode, it
    subscribes only to the selected topic, and only while the output has subscribers.
    """

    def __init__(
        self, target: str, selection: Selection, *, lazy: bool, latch: bool, wait_s: float = 0.0
    ) -> None:
        """Subscribe to the inputs. `wait_s` is how long subscribers have to connect at first."""
        self.selection = selection
        self._wait_s = wait_s
        self._lazy, self._latch = lazy, latch
        self._output = Output(target, self._follow)
        self._lock = threading.RLock()
        self._inputs = {topic: self._input(topic) for topic in selection.topics}
        self._follow()

    def _input(self, topic: str) -> Input:
        return Input(topic, lambda message: self._on_message(topic, message))

    def _on_message(self, topic: str, message: AnyMsg) -> None:
        if self._output.advertise_like(message, self._latch):
            rospy.loginfo("advertising")
            wallsleep(self._wait_s)
            self._follow()
        if topic != self.selection.selected:
            return
        if self._lazy and not self._output.subscribers:
            self._follow()
            if not self._output.subscribers:
                return
        self._output.publish(message)

    def _follow(self) -> None:
        """Subscribe to the inputs that are needed now, and unsubscribe from the others."""
        with self._lock:
            everything = not self._lazy or not self._output.is_advertised
            for topic, source in self._inputs.items():
                wanted = topic == self.selection.selected and self._output.subscribers > 0
                if everything or wanted:
                    source.subscribe()
                elif source.unsubscribe():
                    rospy.loginfo("Unregistering from %s", topic)

    def select(self, topic: str) -> str:
        """Select an input, or none if `topic` is `__none`. Return the previous selection.

        Raises:
            BadSelection: `topic` is not an input of the mux.
        """
        rospy.loginfo("trying to switch mux to %s", topic)
        with self._lock:
            before = self.selection.select(topic)
            self._follow()
        if self.selection.selected:
            rospy.loginfo("mux selected input: [%s]", topic)
        else:
            rospy.loginfo("mux selected to no input.")
        return before

    def add(self, topic: str) -> None:
        """Add an input.

        Raises:
            BadSelection: `topic` is already an input of the mux, or not a valid name.
        """
        with self._lock:
            self.selection.add(topic)
            self._inputs[topic] = self._input(topic)
            self._follow()
        rospy.loginfo("added %s to mux", topic)

    def delete(self, topic: str) -> None:
        """Remove an input.

        Raises:
            BadSelection: `topic` is not an input of the mux, or is currently selected.
        """
        with self._lock:
            self.selection.delete(topic)
            source = self._inputs.pop(topic)
        source.unsubscribe()
        rospy.loginfo("deleted topic %s from mux", topic)


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) < 2:
        print(USAGE)
        return 1
    target, *sources = arguments
    rospy.init_node(f"{base_name(*arguments)}_mux", anonymous=True)
    selection = selection_of("mux", sources)
    first = str(rospy.get_param("~initial_topic", "")) or sources[0]
    try:
        selection.select(first if first == NONE else rospy.resolve_name(first))
    except BadSelection as error:  # not an input: keep the first input selected
        rospy.logwarn("~initial_topic: %s", error)
    lazy, latch = (bool(rospy.get_param(name, False)) for name in ("~lazy", "~latch"))
    waits = bool(rospy.get_param("~wait_publisher_initialization", False))
    wait_s = float(rospy.get_param("~wait_publisher_second", 0.1)) if waits else 0.0
    mux = Mux(target, selection, lazy=lazy, latch=latch, wait_s=wait_s)
    services = Services("Mux", selection)

    def select_by_old_name(topic: str) -> str:
        rospy.logwarn("the <topic>_select service is deprecated; use mux/select instead")
        return mux.select(topic)

    services.announce()
    services.serve("Select", mux.select)
    services.serve("Select", select_by_old_name, f"{target}_select")
    services.serve("Add", mux.add)
    services.serve("Delete", mux.delete)
    services.serve_list()
    rospy.spin()
    return 0
