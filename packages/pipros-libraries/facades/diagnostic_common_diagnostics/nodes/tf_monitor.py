"""`rosrun diagnostic_common_diagnostics tf_monitor.py`: report problems with the transforms on /tf."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from tf2_msgs.msg import TFMessage

import rospy
from diagnostic_common_diagnostics.nodes.monitor import report_of
from diagnostic_updater import Updater
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics.items import ERROR, OK, WARN
from pipros_libraries.diagnostics.machine import Report
from pipros_libraries.transforms import diagnose
from pipros_libraries.transforms.diagnose import ReceivedTransform

PERIOD_S = 1.0

Check = Callable[[Sequence[ReceivedTransform]], list[str] | bool]


def _is_silent(received: Sequence[ReceivedTransform]) -> bool:
    return not received


TASKS: list[tuple[str, Check, int, str]] = [
    ("Messaging status", _is_silent, WARN, "No tf messages received"),
    ("Time status", diagnose.of_other_times, WARN, "Received out-of-date/future transforms"),
    ("Reparenting status", diagnose.reparented, ERROR, "TF re-parenting contention"),
    ("Cycle status", diagnose.loops, ERROR, "TF cycle detection"),
    ("Multiple authority status", diagnose.of_several_senders, ERROR, "TF multiple authority contention"),
]
"""The published statuses: name, check, and the level and message to report if the check finds a problem."""


class Listener:
    """Collector of the transforms received in each period."""

    def __init__(self) -> None:
        self._received: list[ReceivedTransform] = []
        self._reported: list[ReceivedTransform] = []
        rospy.Subscriber("/tf", TFMessage, self._on_message)

    def _on_message(self, message: Any) -> None:
        self._received.extend(diagnose.received_in(message, rospy.get_rostime()))

    def end_period(self) -> None:
        """Make the transforms received since the last call available to subsequent calls to `report`."""
        self._reported, self._received = self._received, []

    def report(self, check: Check, level: int, message: str) -> Report:
        """Return the results of a check, with `level` and `message` if it finds a problem."""
        found = check(self._reported)
        if not found:
            return Report(OK, "OK")
        texts = found if isinstance(found, list) else []
        return Report(level, message, [(f"Error {number}", text) for number, text in enumerate(texts, 1)])


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("tf_monitor")
    listener = Listener()
    updater = Updater()
    updater.setHardwareID("none")
    for name, check, level, message in TASKS:
        updater.add(name, report_of(partial(listener.report, check, level, message)))
    while not rospy.is_shutdown():
        rospy.rostime.wallsleep(PERIOD_S)
        listener.end_period()
        updater.update()
    return 0
