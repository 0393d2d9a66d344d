"""What `pipros doctor` says of fleet agents."""

from __future__ import annotations

import pytest

from pipros.fleet.health import CHECK
from pipros.health.room_check import RoomReply, room_checks

NODE = "/pipros_fleet_robot1"


@pytest.mark.parametrize(
    ("reply", "reasons"),
    [
        (RoomReply(CHECK, True), []),
        (RoomReply(CHECK, False), ["no router is connected"]),
        (RoomReply(CHECK, failure="timed out"), ["timed out"]),
    ],
)
def test_an_agent_without_a_link_is_found(reply: RoomReply, reasons: list[str]) -> None:
    findings = list(CHECK.judge(NODE, reply))

    assert [(finding.rule, finding.subjects) for finding in findings] == [("fleet-link", (NODE,))] * len(
        reasons
    )
    assert [finding.summary.rpartition(": ")[2] for finding in findings] == reasons
    assert CHECK in room_checks()
