"""`rosrun topic_tools relay`: republish a topic's messages on another topic."""

from __future__ import annotations

import threading

import rosgraph
import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.any_msg import AnyMsg
from topic_tools.nodes.output import Input, Output, base_name, is_latched

USAGE = "\nusage: relay IN_TOPIC [OUT_TOPIC]\n"


class Relay:
    """Republisher of a topic. It subscribes until a first message has determined the type of the output.

    Afterwards, in lazy mode, it stays subscribed only while its output has subscribers; in stealth mode, only
    while another node subscribes to the monitored topic.
    """

    def __init__(self, source: str, target: str, *, lazy: bool, stealth: bool) -> None:
        self._lazy, self._stealth = lazy and not stealth, stealth
        self._is_watched = False
        self._output = Output(target, self._on_subscriber)
        self.source = Input(source, self._on_message)

    def _on_message(self, message: AnyMsg) -> None:
        latch = is_latched(message)
        if self._output.advertise_like(message, latch):
            if latch:
                rospy.logdebug("input topic is latched; latching output topic to match")
            rospy.loginfo("advertised as %s\n", self._output.topic)
        if self._stealth and not self._is_watched:
            return
        if self._lazy and self.source.is_idle(self._output):
            return
        self._output.publish(message)

    def _on_subscriber(self) -> None:
        if self._lazy and self.source.subscribe():
            rospy.logdebug("lazy mode; resubscribing")

    def check_subscribers(self, topic: str) -> None:
        """Record whether another node subscribes to `topic`, for `follow` and the input's callback.

        If the master does not respond, log an error.
        """
        master = rosgraph.Master(rospy.get_name())
        try:
            _, subscribers, _ = master.getSystemState()
        except (OSError, rosgraph.MasterException):
            rospy.logerr("Failed to communicate with rosmaster")
            return
        nodes = {node for name, names in subscribers if name == topic for node in names}
        self._is_watched = bool(nodes - {rospy.get_name()})

    def follow(self) -> None:
        """Subscribe or unsubscribe according to the last call to `check_subscribers`.

        The relay stays subscribed until a first message has determined the type of the output.
        """
        if self._is_watched:
            self.source.subscribe()
        elif self._output.is_advertised:
            self.source.unsubscribe()


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if not arguments:
        print(USAGE)
        return 1
    source = arguments[0]
    target = arguments[1] if len(arguments) > 1 else f"{source.rstrip('/')}_relay"
    rospy.init_node(f"{base_name(source, target)}_relay", anonymous=True)
    stealth = bool(rospy.get_param("~stealth", False))
    relay = Relay(source, target, lazy=bool(rospy.get_param("~lazy", False)), stealth=stealth)
    relay.source.subscribe()
    if stealth:
        topic = rospy.resolve_name(str(rospy.get_param("~monitor_topic", source)))
        rate = float(rospy.get_param("~monitor_rate", 1.0))
        if not rate > 0.0:
            rospy.logerr(f"~monitor_rate must be > 0 Hz, got {rate}")
            return 1
        ended = threading.Event()
        rospy.on_shutdown(ended.set)
        relay.check_subscribers(topic)
        while not ended.wait(1.0 / rate):
            relay.check_subscribers(topic)
            relay.follow()
        return 0
    rospy.spin()
    return 0
