"""Nodes on `ros_discovery_info`: nothing is published before the size of GIDs is known."""

from __future__ import annotations

import pytest

from pipros_ros2.rtps.graph_info import (
    GidBytes,
    GraphInfo,
    Knowledge,
    NodeInfo,
    ParticipantInfo,
    read_info,
    write_info,
)

OWN = bytes(range(16))
OTHER = bytes(range(100, 116))
NODES = (
    NodeInfo("/", "talker", writers=(OTHER[:12] + b"\0\0\1\3",)),
    NodeInfo("/robot", "ears", readers=(OTHER[:12] + b"\0\0\2\4", OTHER[:12] + b"\0\0\3\4")),
)
OF_OTHER = ParticipantInfo(OTHER, NODES)


class Recorder:
    """A writer that keeps what it writes."""

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self.is_closed = False

    def write(self, payload: bytes) -> None:
        self.written.append(payload)

    def close(self) -> None:
        self.is_closed = True


class Domain:
    """A participant's graph information, with the writers that it made."""

    def __init__(self, size: GidBytes | None = None) -> None:
        self.writers: list[Recorder] = []
        self.info = GraphInfo(OWN, self._make_writer, size)

    def _make_writer(self) -> Recorder:
        self.writers.append(Recorder())
        return self.writers[-1]


@pytest.mark.parametrize("size", GidBytes)
@pytest.mark.parametrize("nodes", [(), NODES[:1], NODES])
def test_messages_are_read_back_with_their_size_only(size: GidBytes, nodes: tuple[NodeInfo, ...]) -> None:
    info = ParticipantInfo(OTHER, nodes)
    payload = write_info(info, size)

    assert read_info(payload, size) == info
    assert [read_info(payload, other) for other in GidBytes if other is not size] == [None]
    assert read_info(payload + bytes(3), size) == info


@pytest.mark.parametrize("size", GidBytes)
def test_the_bytes_are_those_of_cdr(size: GidBytes) -> None:
    padding = bytes(size - 16)
    payload = write_info(ParticipantInfo(OTHER, (NodeInfo("/", "ab", (OWN,)),)), size)

    assert (
        payload
        == (
            b"\0\1\0\0" + OTHER + padding + b"\1\0\0\0"  # one node
            b"\2\0\0\0/\0\0\0" + b"\3\0\0\0ab\0\0" + b"\1\0\0\0" + OWN + padding + b"\0\0\0\0"
        )
    )


@pytest.mark.parametrize("size", GidBytes)
def test_nothing_is_published_before_the_size_is_known(size: GidBytes) -> None:
    domain = Domain()
    domain.info.announce(NODES)
    assert (domain.writers, domain.info.knowledge) == ([], Knowledge.UNKNOWN)

    domain.info.on_message(write_info(OF_OTHER, size), OTHER[:12])

    assert domain.writers[0].written == [write_info(ParticipantInfo(OWN, NODES), size)]
    assert domain.info.others == {OTHER: OF_OTHER}


def test_a_given_size_is_used_at_once() -> None:
    domain = Domain(GidBytes.HUMBLE)
    assert domain.writers == []
    domain.info.announce(NODES)

    assert domain.writers[0].written == [write_info(ParticipantInfo(OWN, NODES), GidBytes.HUMBLE)]


def test_nothing_more_is_published_in_a_domain_with_both_sizes() -> None:
    domain = Domain()
    domain.info.announce(NODES)
    for size, guid in ((GidBytes.HUMBLE, OTHER), (GidBytes.IRON_AND_LATER, OTHER[::-1])):
        domain.info.on_message(write_info(ParticipantInfo(guid), size), guid[:12])
    domain.info.announce(NODES[:1])

    assert domain.info.knowledge is Knowledge.MIXED
    assert [(len(each.written), each.is_closed) for each in domain.writers] == [(1, True)]


def test_a_message_about_another_participant_is_ignored() -> None:
    domain = Domain()
    domain.info.on_message(write_info(OF_OTHER, GidBytes.HUMBLE), OWN[:12])

    assert (domain.info.others, domain.info.size) == ({}, None)


@pytest.mark.parametrize("length", range(0, 60, 7))
def test_truncated_messages_are_ignored(length: int) -> None:
    domain = Domain()
    domain.info.on_message(write_info(OF_OTHER, GidBytes.HUMBLE)[:length], OTHER[:12])

    assert domain.info.knowledge is Knowledge.UNKNOWN


def test_the_nodes_of_a_participant_end_with_it() -> None:
    domain = Domain()
    domain.info.on_message(write_info(OF_OTHER, GidBytes.HUMBLE), OTHER[:12])
    domain.info.forget(OTHER[:12])

    assert domain.info.others == {}
