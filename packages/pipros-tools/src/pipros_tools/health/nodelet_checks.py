"""Find Python nodelets that are too slow for their inputs."""

from __future__ import annotations

import re
from collections.abc import Iterable

from pipros.basics.printable import listed
from pipros_tools.graph.system_state import SystemState
from pipros_tools.health.finding import Findings, warning
from pipros_tools.health.system_report import SystemReport

INPUTS = "/inputs"
"""Name suffix of the std_srvs/Trigger service that pipros's nodelet managers offer."""

_DROPPED = re.compile(r"(?<!\S)(\S+) [\d.]+ Hz, ([1-9]\d*) of (\d+) dropped")


def services_of_managers(state: SystemState) -> Iterable[str]:
    """Return the services with which Python nodelet managers report on their nodelets."""
    return [
        name
        for name in state.services
        if name.endswith(INPUTS) and f"{name.removesuffix(INPUTS)}/load_nodelet" in state.services
    ]


def slow_nodelets(system: SystemReport) -> Findings:
    """Find nodelets that dropped messages within the last minute."""
    for line in system.nodelets:
        name, _, inputs = line.partition(" ")
        for topic, dropped, received in _DROPPED.findall(inputs):
            yield warning(
                "slow-nodelet",
                f"The nodelet [{listed(name)}] dropped {dropped} of {received} messages of [{listed(topic)}] "
                "within a minute",
                "It is slower than its input. Lower the rate or the size of the input, or load the nodelet "
                "into its own manager.",
                name,
                topic,
            )
