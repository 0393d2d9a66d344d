"""What the monitors have in common: their node, and sending what they report."""

from __future__ import annotations

import importlib
import math
import socket
from collections.abc import Callable
from typing import Any

import rospy
from diagnostic_updater import Updater
from pipros.libraries.diagnostics.machine import Report
from pipros.msg import load_message_class


def hostname() -> str:
    """The name of this machine."""
    return socket.gethostname()


def init(program: str) -> str:
    """Starts the node, which is named after the machine too. Returns the machine's name."""
    host = hostname()
    clean = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in host)
    rospy.init_node(f"{program}_{clean}")
    return host


def psutil() -> Any:
    """The library that reads the machine.

    Raises:
        SystemExit: it is not installed.
    """
    try:
        return importlib.import_module("psutil")
    except ImportError:
        raise SystemExit("this monitor needs psutil; try: pip install 'pipros[monitor]'") from None


def number(name: str, default: float) -> float:
    """A parameter that is a number above 0.

    Raises:
        SystemExit: it is something else.
    """
    value = rospy.get_param(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise SystemExit(f"{name} must be a number above 0, got {value!r}")
    return value


def report_of(read: Callable[[], Report]) -> Callable[[Any], Any]:
    """A task for an updater that reports what `read` returns."""

    def task(status: Any) -> Any:
        report = read()
        status.summary(report.level, report.message)
        for key, value in report.values:
            status.add(key, value)
        return status

    return task


def run_updater(name: str, hardware_id: str, read: Callable[[], Report], hz: float) -> int:
    """Reports until the node is ended. Returns the exit code."""
    updater = Updater()
    updater.setHardwareID(hardware_id)
    updater.add(name, report_of(read))
    rate = rospy.Rate(hz)
    while not rospy.is_shutdown():
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
        updater.update()
    return 0


def publish_all(reports: Callable[[], list[tuple[str, Report]]], hardware_id: str, period_s: float) -> int:
    """Publishes statuses by their full names until the node is ended. Returns the exit code."""
    array_class: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
    status_class: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
    pair: Any = load_message_class("diagnostic_msgs/KeyValue")
    publisher = rospy.Publisher("/diagnostics", array_class, queue_size=10)
    while not rospy.is_shutdown():
        array = array_class()
        array.status = [
            status_class(
                report.level, name, report.message, hardware_id, [pair(*both) for both in report.values]
            )
            for name, report in reports()
        ]
        array.header.stamp = rospy.Time.now()
        publisher.publish(array)
        try:
            rospy.sleep(period_s)
        except rospy.ROSInterruptException:
            break
    return 0
