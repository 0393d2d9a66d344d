"""The monitors of diagnostic_common_diagnostics report under the names of the genuine ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

DiagnosticArray: Any = load_message_class("diagnostic_msgs/DiagnosticArray")

PROGRAMS = [
    ("cpu_monitor.py", ["_warning_percentage:=100", "_window:=2"], ["CPU Information"]),
    ("ram_monitor.py", ["_warning_percentage:=100", "_rate:=20"], ["RAM Information"]),
    ("sensors_monitor.py", [], ["Sensor Status"]),
    ("hd_monitor.py", ["--diag-hostname=cX", "/"], ["HD Temperature", "HD Usage"]),
]


@pytest.mark.parametrize(("program", "arguments", "ends"), PROGRAMS)
def test_names_and_keys_are_those_of_genuine(
    plain_ros: RosSystem, program: str, arguments: list[str], ends: list[str]
) -> None:
    plain_ros.pipros.start_bare_master()
    seen = {side: reported(plain_ros, side, program, arguments, ends) for side in ("genuine", "pipros")}

    assert seen["pipros"].keys() == seen["genuine"].keys()
    for name, (hardware_id, keys) in seen["genuine"].items():
        assert seen["pipros"][name][0] == hardware_id
        # Sensors depend on the hardware, and the genuine monitor cannot read disk space under Python 3.
        if name.endswith("Information"):
            assert seen["pipros"][name][1] == keys


SENDERS = [
    ("one", "map", "base"),
    ("two", "odom", "base"),
    ("three", "left", "right"),
    ("four", "right", "left"),
]
"""Nodes that send a transform each: two that give a frame different parents, two that form a cycle."""


@pytest.mark.timeout(300)
def test_faulty_transforms_are_reported_as_by_genuine(plain_ros: RosSystem) -> None:
    plain_ros.pipros.start_bare_master()
    for name, parent, child in SENDERS:
        numbers = ["0"] * 6
        publisher = ["rosrun", "tf", "static_transform_publisher", *numbers, parent, child, "20"]
        plain_ros.pipros.start(*publisher, f"__name:={name}")

    seen = {side: faults_told(plain_ros, side) for side in ("genuine", "pipros")}

    assert seen["pipros"] == seen["genuine"]


def faults_told(ros: RosSystem, side: str) -> dict[str, tuple[int, str, frozenset[str]]]:
    """Return level, message and texts of each status of tf_monitor.py, once it has data of all nodes."""
    came: dict[str, tuple[int, str, frozenset[str]]] = {}

    def keep(array: Any) -> None:
        for status in array.status:
            texts = frozenset(pair.value for pair in status.values)
            came[status.name] = (status.level, status.message, texts)

    with Node(f"probe_{side}", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe("/diagnostics", DiagnosticArray, keep)
        started = getattr(ros, side).start("rosrun", "diagnostic_common_diagnostics", "tf_monitor.py")

        def complete() -> dict[str, tuple[int, str, frozenset[str]]] | None:
            seen = dict(came)  # the next messages may have other faults, if this machine is busy
            counts = {name.rpartition(": ")[2]: len(texts) for name, (_, _, texts) in seen.items()}
            is_complete = counts == {
                "Messaging status": 0,
                "Time status": 0,
                "Reparenting status": 2,
                "Cycle status": 2,
                "Multiple authority status": 2,
            } and all(message != "Node starting up" for _, message, _ in seen.values())
            return seen if is_complete else None

        seen = wait_until(complete, 120, lambda: f"{came} {started.output}")
        started.end()
    assert seen is not None
    return seen


def reported(
    ros: RosSystem, side: str, program: str, arguments: list[str], ends: list[str]
) -> Mapping[str, tuple[str, list[str]]]:
    """Return the hardware and the keys of each status of a program, once all have values."""
    came: dict[str, Any] = {}
    with Node(f"probe_{side}", environment=Environment(master_uri=ros.master_uri)) as node:
        node.subscribe(
            "/diagnostics",
            DiagnosticArray,
            lambda array: came.update({status.name: status for status in array.status}),
        )
        started = getattr(ros, side).start("rosrun", "diagnostic_common_diagnostics", program, *arguments)

        def is_complete() -> bool:
            ready = [name for name, status in list(came.items()) if is_filled(status)]
            return all(any(name.endswith(end) for name in ready) for end in ends)

        wait_until(is_complete, 60, lambda: f"{came} {started.output}")
        started.end()
    return {
        name: (status.hardware_id, [pair.key for pair in status.values])
        for name, status in came.items()
        if any(name.endswith(end) for end in ends)
    }


def is_filled(status: Any) -> bool:
    """Return False for the first statuses: the node is starting up, or has not read any data yet."""
    is_first = status.message == "Node starting up"
    return not is_first and not any(pair.value == "No Data" for pair in status.values)
