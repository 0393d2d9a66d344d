"""Self-test: a master, a talker and a listener in this process, examined like any other system."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Any

from pipros.basics.env import Environment
from pipros_tools.health.finding import Finding, error
from pipros_tools.health.gather_system import gather_system
from pipros_tools.health.graph_checks import check_graph

TOPIC = "/pipros_self_test"


@dataclass(frozen=True, slots=True)
class SelfTest:
    """The result of the self-test.

    Attributes:
        findings: the problems; empty if there were none.
        first_message_s: the time from the subscription to the first received message; 0 if none arrived.
        heard: the number of received messages.
    """

    findings: list[Finding]
    first_message_s: float
    heard: int


def run_self_test(duration_s: float = 1.0, environment: Environment | None = None) -> SelfTest:
    """Run the self-test on loopback and a free port.

    Blocks for about `duration_s`; if no message arrives, for at least 10 seconds.
    """
    from pipros.msg import load_message_class
    from pipros.node import Node
    from pipros_tools.launch.roscore import Core

    text: Any = load_message_class("std_msgs/String")
    local = (environment or Environment.from_os())._replace(hostname=None, ip="127.0.0.1", namespace="/")
    heard: list[float] = []
    first = threading.Event()

    def hear(_: Any) -> None:
        heard.append(time.monotonic())
        first.set()

    with Core(port=0, environment=local) as core:
        local = local._replace(master_uri=core.uri)
        with Node("listener", environment=local) as listener, Node("talker", environment=local) as talker:
            start = time.monotonic()
            listener.subscribe(TOPIC, text, hear)
            publisher = talker.advertise(TOPIC, text, latch=True)
            publisher.publish(text("hello"))
            if not first.wait(max(duration_s, 10.0)):
                finding = error(
                    "self-test",
                    "A listener received nothing from a talker in the same process",
                    "Programs on this machine cannot connect to each other at 127.0.0.1. Check for a "
                    "firewall, or a sandbox without a loopback interface.",
                )
                return SelfTest([finding], 0.0, 0)
            while time.monotonic() - start < duration_s:
                publisher.publish(text("hello"))
                talker.wait_for_shutdown(timeout_s=0.1)
            findings = check_graph(gather_system(core.uri))
    return SelfTest(findings, heard[0] - start, len(heard))
