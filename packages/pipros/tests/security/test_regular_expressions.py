"""Regular expressions that other nodes set as parameters cannot block a process."""

from __future__ import annotations

from typing import Any

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

DiagnosticArray: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
DiagnosticStatus: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")

ANALYZERS = {"a": {"type": "GenericAnalyzer", "path": "A", "regex": "(a+)+$"}}
STATUS = "a" * 40 + "!"


def test_an_aggregator_gives_up_a_regex_that_takes_too_long(ros: RosSystem) -> None:
    ros.serve_master()
    newest: dict[str, str] = {}

    def keep(array: Any) -> None:
        newest.update({status.name: status.message for status in array.status})

    with Node("peer", environment=Environment(master_uri=ros.master_uri)) as node:
        node.master.set_param("/diagnostic_aggregator/analyzers", ANALYZERS)
        aggregator = ros.pipros.start("rosrun", "diagnostic_aggregator", "aggregator_node", "_pub_rate:=50")
        node.subscribe("/diagnostics_agg", DiagnosticArray, keep)
        array = DiagnosticArray(status=[DiagnosticStatus(0, STATUS, "m", "hw", [])])
        array.header.stamp.secs = 1
        node.advertise("/diagnostics", DiagnosticArray, latch=True).publish(array)

        wait_until(lambda: f"/Other/{STATUS}" in newest, 60, lambda: f"{newest} {aggregator.output}")
        assert newest["/A"] == "A regex takes too long and is no longer used"
        aggregator.press_ctrl_c()
        assert aggregator.wait() == 0
