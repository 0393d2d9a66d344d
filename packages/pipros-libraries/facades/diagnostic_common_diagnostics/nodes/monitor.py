"""Shared code of the monitors: start the node, read parameters, and publish reports."""

from __future__ import annotations

import importlib
import math
import socket
from collections.abc import Callable
from typing import Any

import rospy
from diagnostic_updater import Updater
from pipros.basics.extras import install_command
from pipros.msg import load_message_class
from pipros_libraries.diagnostics.machine import Report


def hostname() -> str:
    """Return the name of this machine."""
    return socket.gethostname()


def init(program: str) -> str:
    """Start a node called `<program>_<machine>`. Return the machine's name.

    In the node's name, underscores replace all characters other than ASCII letters and digits.
    """
    host = hostname()
    clean = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in host)
    rospy.init_node(f"{program}_{clean}")
    return host


def psutil() -> Any:
    """Return the module psutil.

    Raises:
        SystemExit: psutil is not installed.
    """
    try:
        return importlib.import_module("psutil")
    except ImportError:
        raise SystemExit(
            f"this monitor needs psutil, which is not installed. Try: {install_command('monitor')}"
        ) from None


def number(name: str, default: float) -> float:
    """Return a parameter that must be a finite number > 0.

    Raises:
        SystemExit: the parameter is not such a number.
    """
    value = rospy.get_param(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < math.inf:
        raise SystemExit(f"{name} must be a finite number > 0, got {value!r}")
    return value


def report_of(read: Callable[[], Report]) -> Callable[[Any], Any]:
    """Return an updater task that reports the result of `read`."""

    def task(status: Any) -> Any:
        report = read()
        status.summary(report.level, report.message)
        for key, value in report.values:
            status.add(key, value)
        return status

    return task


def run_updater(name: str, hardware_id: str, read: Callable[[], Report], hz: float) -> int:
    """Call an updater `hz` times per second until the node is shut down. Return the exit code.

    The updater calls `read` and publishes the report at most once per `~diagnostic_period`.
    """
    updater = Updater()
    updater.setHardwareID(hardware_id)
    updater.add(name, report_of(read))
    rate = rospy.Rate(hz, reset=True)
    while not rospy.is_shutdown():
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
        updater.update()
    return 0


def publish_all(reports: Callable[[], list[tuple[str, Report]]], hardware_id: str, period_s: float) -> int:
    """Publish statuses every `period_s` seconds until the node is shut down. Return the exit code.

    In contrast to `run_updater`, the node's name is not prepended to the names of the statuses.
    """
    array_class: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
    status_class: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
    pair: Any = load_message_class("diagnostic_msgs/KeyValue")
    publisher = rospy.Publisher("/diagnostics", array_class, queue_size=10)
    rate = rospy.Rate(1.0 / period_s, reset=True)
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
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    return 0
