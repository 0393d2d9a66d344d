"""`Updater`, which runs tasks and publishes their reports."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from threading import RLock
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

import rospy
from diagnostic_updater.status import DiagnosticStatusWrapper

_PERIOD_CHECK_S = 0.25


class DiagnosticTaskVector:
    """A list of tasks, which can be looked up by name."""

    class DiagnosticTaskInternal:
        """A task's name and function."""

        def __init__(self, name: str, fn: Callable[[Any], Any]) -> None:
            self.name = name
            self.fn = fn

        def run(self, stat: Any) -> Any:
            """Set the status's name to the task's name, and run the task."""
            stat.name = self.name
            return self.fn(stat)

    def __init__(self) -> None:
        self.tasks: list[Any] = []
        self.lock = RLock()

    def addedTaskCallback(self, task: Any) -> None:
        """Do nothing. Called by `add` with the added task; subclasses may override this method."""

    def add(self, *args: Any) -> None:
        """Add a task, given as an object, or as a name and a function that takes a status and returns it."""
        name, function = (args[0].getName(), args[0].run) if len(args) == 1 else args
        task = DiagnosticTaskVector.DiagnosticTaskInternal(name, function)
        with self.lock:
            self.tasks.append(task)
            self.addedTaskCallback(task)

    def removeByName(self, name: str) -> bool:
        """Remove the first task with the given name. Return whether a task was removed."""
        with self.lock:
            for task in self.tasks:
                if task.name == name:
                    self.tasks.remove(task)
                    return True
        return False


class Updater(DiagnosticTaskVector):
    """Publisher of the tasks' reports on `/diagnostics`.

    Call `update` at least once per `~diagnostic_period`, the interval between reports in seconds. A task that
    raises is reported as an error; the other tasks still run.
    """

    def __init__(self) -> None:
        super().__init__()
        self.publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self.last_time = rospy.Time.now()
        self.last_time_period_checked = self.last_time
        self.period = 1.0
        self.verbose = False
        self.hwid = ""
        self.warn_nohwid_done = False

    def setHardwareID(self, hwid: str) -> None:
        """Set the hardware ID of the device. Use "none" if the device does not have an ID."""
        self.hwid = hwid

    def update(self) -> None:
        """Publish the reports if the period has elapsed."""
        now = rospy.Time.now()
        if self._is_due(now, self.last_time_period_checked, _PERIOD_CHECK_S):
            self.period = rospy.get_param_cached("~diagnostic_period", 1)
            self.last_time_period_checked = now
        if self._is_due(now, self.last_time, self.period):
            self.force_update()

    @staticmethod
    def _is_due(now: Any, since: Any, period_s: float) -> bool:
        """Return whether the period has elapsed, or the clock has moved back."""
        return not since <= now < since + rospy.Duration(period_s)

    def force_update(self) -> None:
        """Publish the reports immediately."""
        self.last_time = rospy.Time.now()
        with self.lock:
            found = [self._report(task) for task in self.tasks]
        for status in found:
            if self.verbose and status.level:
                words = "Non-zero diagnostic status. Name: '%s', status %i: '%s'"
                rospy.logwarn(words, status.name, status.level, status.message)
        if not self.hwid and not self.warn_nohwid_done and not any(status.level for status in found):
            self.warn_nohwid_done = True
            rospy.logwarn(
                "diagnostic_updater: no hardware ID is set. "
                "Call setHardwareID('none') if the device has none."
            )
        self.publish(found)

    def _report(self, task: Any) -> DiagnosticStatusWrapper:
        status = DiagnosticStatusWrapper(name=task.name, hardware_id=self.hwid)
        status.summary(2, "No message was set")
        try:
            task.run(status)
        except Exception as error:
            status.summary(2, f"The task raised {type(error).__name__}: {error}")
            rospy.logerr("the diagnostic task %s raised %s\n%s", task.name, error, traceback.format_exc())
        return status

    def broadcast(self, lvl: int, msg: str) -> None:
        """Publish the given level and message for every task."""
        with self.lock:
            found = [DiagnosticStatusWrapper(name=task.name) for task in self.tasks]
        for status in found:
            status.summary(lvl, msg)
        self.publish(found)

    def publish(self, msg: Any) -> None:
        """Publish a status or a list of statuses. Prepend the node's name to the name of each status."""
        found = msg if isinstance(msg, list) else [msg]
        for status in found:
            status.name = f"{rospy.get_name()[1:]}: {status.name}"
        message = DiagnosticArray(status=found)
        message.header.stamp = rospy.Time.now()
        self.publisher.publish(message)

    def addedTaskCallback(self, task: Any) -> None:
        """Publish a status that says that the device is starting up."""
        status = DiagnosticStatusWrapper(name=task.name)
        status.summary(0, "Node starting up")
        self.publish(status)
