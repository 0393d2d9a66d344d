"""The names that a member offers to others."""

import json
from collections.abc import Iterable, Sequence

import pytest

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros_fleet.directory import (
    Directory,
    DirectoryEntry,
    TopicRequests,
    from_json,
    requests_from_json,
    requests_to_json,
    to_json,
)
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


# Directory documents of members, including hostile ones.


MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"


def test_a_directory_survives_its_encoding() -> None:
    directory = Directory(
        "r1", "0" * 16, 7,
        (DirectoryEntry("/chatter", "std_msgs/String", MD5), DirectoryEntry("/x", "a/B", MD5)),
        (DirectoryEntry("/cmd", "std_msgs/String", MD5),),
        (DirectoryEntry("/reset", "std_srvs/Empty", MD5, 2.5),), has_parameters=True,
    )  # fmt: skip
    assert from_json(to_json(directory), "r1") == directory


@pytest.mark.parametrize(
    "content", [b"", b"\xff", b"[]", b"{}", b'{"member": "r1"}', b"[" * 100_000, b'{"member": 1}']
)
def test_malformed_directories_raise(content: bytes) -> None:
    with pytest.raises(ProtocolError, match="malformed"):
        from_json(content, "r1")


def test_a_directory_of_another_member_raises() -> None:
    with pytest.raises(ProtocolError, match=r"\[r1\] claims to be that of \[r2\]"):
        from_json(to_json(Directory("r2", "0" * 16)), "r1")


def test_a_directory_that_is_too_large_raises() -> None:
    with pytest.raises(LimitExceeded, match="the limit is 10 bytes"):
        from_json(to_json(Directory("r1", "0" * 16)), "r1", limit_bytes=10)


def test_invalid_entries_are_omitted() -> None:
    good = {"name": "/ok", "type": "a/B", "md5sum": MD5}
    wrong = [
        1, {}, {**good, "name": "relative"}, {**good, "name": "/a//b"}, {**good, "name": "/a/"},
        {**good, "name": "/a\nb"}, {**good, "name": "/~a"}, {**good, "type": "nothing"},
        {**good, "type": "*"}, {**good, "md5sum": "*"}, {**good, "md5sum": 5},
    ]  # fmt: skip
    document = {"member": "r1", "instance": "i", "revision": 1, "shared": [*wrong, good], "services": 4}
    document["accepted"] = [
        {**good, "timeout_s": value} for value in (-1, 1e9, "1", None, float("nan"), True)
    ]
    found = from_json(json.dumps(document).encode(), "r1")
    assert found.shared == (DirectoryEntry("/ok", "a/B", MD5),)
    assert found.services == ()
    assert found.accepted == (DirectoryEntry("/ok", "a/B", MD5),)


def test_requests_survive_their_encoding() -> None:
    requests = TopicRequests("0" * 16, 4, frozenset({"/b", "/a"}))
    assert requests_from_json(requests_to_json(requests)) == requests
    assert requests_from_json(requests_to_json(requests), limit_bytes=2) is None
    for content in (b"", b"{}", b"\xff", b"[]"):
        assert requests_from_json(content) is None
