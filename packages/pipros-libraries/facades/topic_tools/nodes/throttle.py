"""`rosrun topic_tools throttle`: limit the rate or the bandwidth of a topic."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node.any_msg import AnyMsg
from pipros_libraries.topic_tools.rates import ByteRate, MessageRate, RateRule
from topic_tools.nodes.output import Input, Output, base_name, is_latched

USAGE = """
usage:
  throttle messages IN_TOPIC MSGS_PER_SEC [OUT_TOPIC]]
OR
  throttle bytes IN_TOPIC BYTES_PER_SEC WINDOW [OUT_TOPIC]]

  Republish messages of IN_TOPIC on OUT_TOPIC (default: IN_TOPIC_throttle). With "messages",
  republish a message if more than 1/MSGS_PER_SEC seconds have passed since the last one; with
  "bytes", if those of the last WINDOW seconds have less than BYTES_PER_SEC bytes in total.
  Other messages are dropped.
"""


_NUMBERS = {"messages": 1, "bytes": 2}
"""Number of numeric arguments for each kind of rule."""


class Throttle:
    """Republisher of the messages that a rule accepts."""

    def __init__(self, source: str, target: str, rule: RateRule, *, lazy: bool, latch: bool | None) -> None:
        """Set up the topics. If `latch` is None, latch the output if the input's publisher latches."""
        self._rule, self._lazy = rule, lazy
        self._latches = is_latched if latch is None else lambda _: latch
        self._is_wall_clock = bool(rospy.get_param("~wall_clock", False))
        self._turn = threading.Lock()
        self._output = Output(target, self._on_subscriber)
        self.source = Input(source, self._on_message)

    def _on_message(self, message: AnyMsg) -> None:
        if self._output.advertise_like(message, self._latches(message)):
            print(f"advertised as {self._output.topic}", flush=True)
        if self._lazy and self.source.is_idle(self._output):
            return
        now = time.time_ns() if self._is_wall_clock else rospy.get_rostime().to_nsec()
        with self._turn:
            passes = self._rule.passes(now, len(message.body))
        if self._rule.has_gone_back:
            rospy.logwarn("Detected jump back in time, resetting throttle period to now.")
        if passes:
            self._output.publish(message)

    def _on_subscriber(self) -> None:
        if self._lazy and self.source.subscribe():
            rospy.logdebug("lazy mode; resubscribing")


def number_above_0(name: str, text: str) -> float:
    """Parse an argument as a number.

    Raises:
        SystemExit: the argument is not a finite number > 0.
    """
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < math.inf:
        raise SystemExit(f"{name} must be a finite number > 0, got {text}")
    return number


def _rule_of(kind: str, numbers: Sequence[str]) -> RateRule:
    if kind == "messages":
        return MessageRate(number_above_0("MSGS_PER_SEC", numbers[0]))
    window_s = number_above_0("WINDOW", numbers[1])
    return ByteRate(number_above_0("BYTES_PER_SEC", numbers[0]), window_s)


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    words = rospy.myargv()[1:]
    count = _NUMBERS.get(next(iter(words), ""), 0)
    if not count or len(words) - count not in (2, 3):
        print(USAGE)
        return 1
    kind, source, *more = words
    rule, named = _rule_of(kind, more[:count]), more[count:]
    rospy.init_node(f"{base_name(source, *named)}_throttle", anonymous=True)
    latch = bool(rospy.get_param("~force_latch")) if rospy.has_param("~force_latch") else None
    lazy = bool(rospy.get_param("~lazy", False))
    target = named[0] if named else f"{source.rstrip('/')}_throttle"
    Throttle(source, target, rule, lazy=lazy, latch=latch).source.subscribe()
    rospy.spin()
    return 0
