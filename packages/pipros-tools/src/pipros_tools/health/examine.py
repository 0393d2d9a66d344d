"""Examine this machine, then the running system, for `pipros doctor`."""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from pipros.basics import names
from pipros.basics.env import Environment, InvalidEnvironment, split_master_uri
from pipros.basics.errors import PiprosError
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.master_client import MasterClient
from pipros.net.rpc_server import RpcServer
from pipros.net.sockets import NoFreePort
from pipros.net.this_machine import is_this_machine
from pipros_tools.health.finding import Finding, error, has_errors
from pipros_tools.health.gather_machine import gather_machine
from pipros_tools.health.gather_system import gather_system
from pipros_tools.health.graph_checks import check_graph
from pipros_tools.health.machine_checks import check_machine
from pipros_tools.health.system_report import SystemReport

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
    `pipros_tools.health.examine`. Blocks up to `timeout_s` per peer.
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
        from pipros_tools.health.reach_back import reach_back

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


WAIT_S = 0.8


def uncalled_address(environment: Environment, *, timeout_s: float) -> str:
    """Return a URI that was registered with the master but that the master did not call within `WAIT_S`.

    The result is empty if the master called the URI, or if the test is not possible because no port is free
    or the master does not answer. The test subscribes to a parameter and sets it briefly as another node,
    because the master notifies all subscribers except the node that sets the parameter. (Programs that record
    all topics would subscribe to a test topic.)
    """
    name = f"/{names.anonymous('pipros_doctor')}"
    called = threading.Event()

    def param_update(*_: Any) -> list[Any]:
        called.set()
        return [1, "", 0]

    table = {
        "paramUpdate": param_update,
        "getPid": lambda *_: [1, "", 0],
        "shutdown": lambda *_: [1, "", 0],
    }
    loop = BackgroundLoop("call from the master")
    master = MasterClient(environment.master_uri, name, timeout_s=timeout_s)
    setter = MasterClient(environment.master_uri, f"{name}_setter", timeout_s=timeout_s)
    loop.start()
    try:
        advertised = address.advertised_address(environment)
        server = RpcServer(table, host=address.bind_host(environment), port=environment.port_range or 0)
        loop.run(server.start())
        uri = address.uri(*advertised.outside(server.port))
        key = f"{name}_called"  # not in a namespace, which genuine masters would keep
        until = time.monotonic() + WAIT_S
        try:
            master.subscribe_param(uri, key)
            setter.set_param(key, True)
            return "" if called.wait(max(until - time.monotonic(), WAIT_S / 2)) else uri
        finally:
            with suppress(PiprosError):
                master.call("unsubscribeParam", uri, key)
                setter.delete_param(key)
            loop.run(server.stop())
    except (OSError, PiprosError):
        return ""
    finally:
        setter.close()
        master.close()
        loop.stop()
