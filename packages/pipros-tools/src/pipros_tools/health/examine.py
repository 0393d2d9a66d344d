"""Examine this machine, then the running system, for `pipros doctor`."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, replace

from pipros.basics.env import Environment, InvalidEnvironment, split_master_uri
from pipros.basics.errors import PiprosError
from pipros.health.call_back import uncalled_address
from pipros.health.finding import Finding, error, has_errors
from pipros.health.gather_machine import gather_machine
from pipros.health.gather_system import gather_system
from pipros.health.graph_checks import check_graph
from pipros.health.machine_checks import check_machine
from pipros.health.system_report import SystemReport
from pipros.net.sockets import NoFreePort
from pipros.net.this_machine import is_this_machine

CONNECTION_RULES = {"not-connected", "one-sided-connection"}


@dataclass(frozen=True, slots=True)
class Examination:
    """The result of an examination.

    Attributes:
        master_uri: the master that was examined.
        findings: findings about the machine, then about the system.
        system: the running system; None if it was not examined or no master answers.
    """

    master_uri: str
    findings: tuple[Finding, ...]
    system: SystemReport | None = None

    @property
    def is_healthy(self) -> bool:
        """Whether there are no errors; warnings are allowed."""
        return not has_errors(self.findings)


def examine(
    environment: Environment | None = None,
    *,
    is_offline: bool = False,
    both_ways: bool = False,
    timeout_s: float = 3.0,
) -> Examination:
    """Examine this machine and, unless `is_offline`, the running system.

    `environment` determines the master, addresses and ports; it defaults to this process's environment. No
    message is sent. If a subscriber lacks a connection, its topic is advertised for up to `timeout_s` to test
    whether the subscriber can connect to this machine. If `both_ways` is true, this is done for every
    subscriber. If the master connects to this machine over the network, a parameter is set briefly; see
    `pipros.health.call_back`. Blocks up to `timeout_s` per peer.
    """
    variables = environment.applied_to(os.environ) if environment is not None else None
    environment = environment or Environment.from_os()
    machine = gather_machine(variables, timeout_s=timeout_s)
    if is_offline:
        machine = replace(machine, master_error=None)
    elif machine.master_error == "" and _is_reached_from_elsewhere(environment):
        machine = replace(machine, not_called_back=uncalled_address(environment, timeout_s=timeout_s))
    findings = check_machine(machine)
    if is_offline or machine.master_error is None or machine.master_error:
        return Examination(environment.master_uri, tuple(findings))
    try:
        system = stable_system(environment, timeout_s, both_ways=both_ways)
    except PiprosError as problem:
        findings.append(
            error(
                "master-lost",
                f"The master at [{environment.master_uri}] answered at first, but no longer does: {problem}",
                "Check its output, its log and the load of its machine, then run this again.",
            )
        )
        return Examination(environment.master_uri, tuple(findings))
    return Examination(environment.master_uri, (*findings, *check_graph(system)), system)


def _is_reached_from_elsewhere(environment: Environment) -> bool:
    """Return whether the master connects to this machine over the network."""
    return bool(environment.advertise) or not is_this_machine(split_master_uri(environment.master_uri)[0])


def stable_system(
    environment: Environment, timeout_s: float, *, topic: str | None = None, both_ways: bool = False
) -> SystemReport:
    """Return a report on the system, or on the nodes of a topic. See `examine`.

    If nodes may still be connecting, they are queried a second time. For subscribers without a connection, or
    for all subscribers if `both_ways` is true, this process advertises the topic.

    Raises:
        Unreachable: the master does not answer.
    """
    system = gather_system(environment.master_uri, topic=topic, timeout_s=timeout_s)
    if any(finding.rule in CONNECTION_RULES for finding in check_graph(system)):
        system = gather_system(environment.master_uri, topic=topic, timeout_s=timeout_s)
    pairs = _to_try_back(system, both_ways=both_ways)
    if topic is not None:
        pairs = frozenset(pair for pair in pairs if pair[0] == topic)
    if pairs:
        from pipros.health.reach_back import reach_back

        with suppress(InvalidEnvironment, NoFreePort):  # `check_machine` reports this error
            reached = reach_back(pairs, environment, wait_s=timeout_s)
            system = replace(system, reached_back=reached, tried_back=pairs)
    return system


def _to_try_back(system: SystemReport, *, both_ways: bool) -> frozenset[tuple[str, str]]:
    if both_ways:
        subscribers = system.state.subscribers.items()
        return frozenset(
            (topic, node) for topic, names in subscribers for node in names if system.is_alive(node)
        )
    wanting = (finding for finding in check_graph(system) if finding.rule == "not-connected")
    return frozenset((finding.subjects[0], finding.subjects[2]) for finding in wanting)
