"""The names that a member offers to others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pytest

from pipros_fleet.fleet_rules import FleetFile, FleetRule
from pipros_fleet.local_graph import LocalGraph, graph_of
from pipros_tools.graph.definitions import Definition
from pipros_tools.graph.system_state import SystemState

ALL = (FleetRule("/**"),)
FILE = FleetFile(accepted_topics=ALL, accepted_services=ALL)


def define(topic: str, kind: str, nodes: Sequence[str]) -> Definition:
    del topic, nodes
    return Definition(kind, "0" * 32, "")


def graph(names: Iterable[str], member: str, others: Iterable[str]) -> LocalGraph:
    """Return what a member offers whose master has topics and services with these names."""
    nodes = {name: ["/node"] for name in names}
    state = SystemState(nodes, nodes, nodes)
    types = dict.fromkeys(nodes, "std_msgs/String")
    return graph_of(state, types, FILE, member, others, define, lambda *_: ("std_srvs/Empty", "0" * 32))


def offered(names: Iterable[str], member: str, others: Iterable[str]) -> set[str]:
    found = graph(names, member, others)
    topics = {entry.name for entry in found.shared}
    assert topics == {entry.name for entry in found.accepted} == {entry.name for entry in found.services}
    return topics


def test_names_of_other_members_are_not_offered() -> None:
    assert offered(["/x", "/b/x", "/bx"], "a", ["b"]) == {"/x", "/bx"}


def test_a_robot_may_use_its_name_as_a_namespace() -> None:
    assert offered(["/a/scan", "/a/odom", "/odom"], "a", ["b"]) == {"/a/scan", "/odom"}


@pytest.mark.parametrize("rounds_until_removed", [1, 2, 3, 100])
def test_names_do_not_grow_if_a_relay_connects_the_masters(rounds_until_removed: int) -> None:
    """Two members see each other's names, and a relay copies all names of each master to the other."""
    members = ("a", "b")
    names = {member: {f"/{member}_only", "/x"} for member in members}
    seen: set[str] = set()
    for number in range(10):
        if number == rounds_until_removed:
            names = {member: found - {"/x", f"/{member}_only"} for member, found in names.items()}
        shown = {
            member: {f"/{member}{name}" for name in offered(names[member], member, set(members) - {member})}
            for member in members
        }
        names = {
            member: (names[member] | names[other] | shown[other])
            if number < rounds_until_removed
            else names[other] | shown[other]  # the relay moves the names that are left
            for member, other in (members, members[::-1])
        }
        seen.update(*names.values())
    assert max(name.count("/") for name in seen) <= 3
    assert len(seen) <= 3 + 2 * 3 + 2 * 3
