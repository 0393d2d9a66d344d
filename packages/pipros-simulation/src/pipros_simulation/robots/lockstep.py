"""Advance simulated time only when other nodes, the members listed in `/lockstep`, have answered.

Theory of operation. After each step with scans, the simulator calls the service `~advance` of each member, in
the order of the list. The request contains the new time and the numbers of messages that the simulator and
the other members have sent to this member so far (`pipros.node.delivery`). The member handles these messages,
performs the work that is due, and replies with the numbers of messages that it has sent, and with the time of
its next work; the member is called at that time even if the step has no scans. Finally, the simulator handles
the messages that the members have sent to it. The steps thus form a fixed sequence regardless of the
machine's speed, and the whole system repeats its trace if its members are deterministic. The lockstep begins
when all topics between the nodes are connected, because earlier messages are lost in some runs but not in
others.

A member that fails or does not answer in time is left out from then on.
"""

from __future__ import annotations

import logging
import time
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.node.delivery import Sent, sent_by, wait_until_handled
from pipros_libraries.nodes.schedule import CAPABLE
from pipros_libraries.transforms.messages import in_ns
from pipros_simulation.robots.errors import InvalidSettings
from pipros_tools.graph.bus_info import established, rows_of
from pipros_tools.graph.live import ask_bus_info
from pipros_tools.graph.system_state import SystemState

PARAMETER: Final = "/lockstep"
"""Parameter with the names of the members, in the order in which they are called."""
ANSWER_S: Final = 30.0
"""Real time within which a member must answer."""
FOREIGN_S: Final = 10.0
"""Real time for which a node must run without a `Schedule` to be left out."""
REPORT_S: Final = 60
"""Simulated time (s) between two reports of the ratio of simulated time to real time."""


def members(node: Node) -> list[str]:
    """Return the names in the parameter `/lockstep`, or an empty list if it is not set.

    Raises:
        InvalidSettings: the parameter is not a list of names.
    """
    try:
        found = node.params.get(PARAMETER)
    except LookupError:
        return []
    if not isinstance(found, list) or not all(isinstance(each, str) and each for each in found):
        raise InvalidSettings(f"{PARAMETER} must be a list of node names, got {found!r}")
    return [each if each.startswith("/") else f"/{each}" for each in found]


class Lockstep:
    """The simulator's side of the lockstep. Not thread-safe."""

    def __init__(self, node: Node, names: list[str], log: logging.Logger) -> None:
        self._node, self._log = node, log
        self._service: Any = load_service_class("pipros_sim/Advance")
        self._clients = {
            name: node.client(f"{name}/advance", self._service, persistent=True) for name in names
        }
        self._sent: dict[tuple[str, str, str], Sent] = {}
        self._due_ns = dict.fromkeys(self._clients, 0)
        self._ready: list[str] = []
        self._began_s = time.monotonic()
        self._simulated_s = 0.0
        self._seen_s: dict[str, float] = {}

    @property
    def has_members(self) -> bool:
        return bool(self._clients)

    def missing(self) -> list[str]:
        """Return the members that do not offer their service yet or, if all do, the missing connections."""
        missing, self._ready = [], []
        for name, client in self._clients.items():
            try:
                client.probe(1.0)
                self._ready.append(name)
            except PiprosError:
                missing.append(name)
        for name in [each for each in missing if self._is_foreign(each)]:
            self._log.error(
                "[%s] runs, but cannot be in lockstep, and is left out; docs/guides/simulation.md lists "
                "those that can. Remove it from %s", name, PARAMETER,
            )  # fmt: skip
            missing.remove(name)
            self._clients.pop(name).close()
        if not missing:
            missing = self._missing_connections()
        self._began_s = time.monotonic()
        return missing

    def _is_foreign(self, name: str) -> bool:
        """Return whether a member has run for a while without being about to offer the service."""
        try:
            self._node.master.lookup_node(name)
            if self._node.params.has(f"{name}/{CAPABLE[1:]}"):
                return False
        except PiprosError:
            self._seen_s.pop(name, None)
            return False
        return time.monotonic() - self._seen_s.setdefault(name, time.monotonic()) > FOREIGN_S

    def _missing_connections(self) -> list[str]:
        """Return a description of each missing connection among the simulator and its members."""
        master = self._node.master
        names = {self._node.name, *self._clients}
        missing = []
        try:
            state = SystemState.from_state(master.get_system_state())
            for name in sorted(names):
                rows = rows_of(ask_bus_info(master.lookup_node(name)), "getBusInfo")
                connected = {(each.topic, each.peer) for each in established(rows) if each.direction == "o"}
                missing += [
                    f"a connection of [{topic}] from [{name}] to [{peer}]"
                    for topic, publishers in state.publishers.items()
                    if name in publishers
                    for peer in state.subscribers.get(topic, ())
                    if peer in names - {name} and (topic, peer) not in connected
                ]
        except (PiprosError, ValueError) as error:
            return [f"an answer about connections ({error})"]
        return missing

    def settle(self, now: Time, *, has_scans: bool) -> bool:
        """Call the members that may have work to do, and wait until their messages have been handled.

        Members that were not ready when `missing` was last called are left out. Return whether one of the
        members requires the time to stop.
        """
        due = [name for name in self._ready if has_scans or self._due_ns[name] <= in_ns(now)]
        if not due:
            return False
        self._add(sent_by(self._node))
        holds = False
        for name in due:
            client = self._clients[name]
            links = [each for each in self._sent.values() if each.subscriber == name]
            request = self._service._request_class(
                now,
                [each.topic for each in links],
                [each.publisher for each in links],
                [each.messages for each in links],
            )
            try:
                answer = client.call(request, ANSWER_S)
            except PiprosError as error:
                if not self._node.is_ending:
                    self._log.error("the lockstep continues without [%s]: %s", name, error)
                del self._clients[name]
                self._ready.remove(name)
                self._sent = {key: each for key, each in self._sent.items() if name not in key}
                continue
            holds = holds or answer.hold
            self._due_ns[name] = in_ns(answer.due)
            links_of = zip(answer.topics, answer.subscribers, answer.counts, strict=True)
            self._add([Sent(topic, name, subscriber, count) for topic, subscriber, count in links_of])
        for lost in wait_until_handled(self._node, self._sent.values(), ANSWER_S):
            self._log.warning("messages of [%s] on [%s] did not arrive", lost.publisher, lost.topic)
        return holds

    def _add(self, sent: list[Sent]) -> None:
        self._sent.update({each[:3]: each for each in sent})

    def count(self, step_s: float) -> None:
        """Count a step, and call `report` every `REPORT_S` of simulated time."""
        before, self._simulated_s = self._simulated_s, self._simulated_s + step_s
        if before // REPORT_S != self._simulated_s // REPORT_S:
            self.report()

    def close(self) -> None:
        """Close the connections to the members."""
        for client in self._clients.values():
            client.close()

    def report(self) -> None:
        """Log the ratio of simulated time to real time since all members were present."""
        taken_s = time.monotonic() - self._began_s
        if self._simulated_s and taken_s:
            factor = self._simulated_s / taken_s
            self._log.info(
                "simulated %.1f s in %.1f s: %.1f times real time", self._simulated_s, taken_s, factor
            )
