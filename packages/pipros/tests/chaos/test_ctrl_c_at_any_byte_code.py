"""One Ctrl-C is enough, even between two bytecode instructions of a wait; see `tests.chaos.interrupt_at`."""

from __future__ import annotations

import os
import sys

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class
from tests.support.environments import REPOSITORY
from tests.support.nodes import MakeNode
from tests.support.processes import Processes

String = load_message_class("std_msgs/String")

MOMENTS = (*range(30, 400, 40), *range(1000, 1250, 50))
"""Spread over the start of the node and its wait. A wait with fewer byte codes gets SIGINT while it lasts."""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the runs are forked children")
@pytest.mark.parametrize("what", ["command", "node"])
def test_ctrl_c_between_two_byte_codes_is_not_lost(
    processes: Processes, master: Master, make_node: MakeNode, what: str
) -> None:
    make_node("talker").advertise("/chatter", String, latch=True).publish(String("x"))
    runs = processes.run(
        sys.executable,
        "-m",
        "tests.chaos.interrupt_at",
        what,
        *map(str, MOMENTS),
        cwd=REPOSITORY,
        environment={"ROS_MASTER_URI": master.uri},
        timeout_s=300,
    )
    assert "done" in runs.stdout, runs.output
    assert "was lost" not in runs.output
    assert "RuntimeError" not in runs.output  # a lock that is released twice
