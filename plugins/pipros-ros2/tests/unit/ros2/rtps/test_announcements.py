"""Announcements of participants and endpoints: conversion to bytes and back."""

import math

import pytest

from pipros_ros2.rtps.announcements import (
    EndpointData,
    ParticipantData,
    entries,
    read_endpoint,
    read_key,
    read_participant,
    write_endpoint,
    write_key,
    write_participant,
)
from pipros_ros2.rtps.graph_info import (
    GidBytes,
    GraphInfo,
    Knowledge,
    NodeInfo,
    ParticipantInfo,
    read_info,
    write_info,
)
from pipros_ros2.rtps.identity import CYCLONE_DDS, guid_text, is_writer, new_prefix, user_entity
from pipros_ros2.rtps.parameters import PARAMETER_LIST, SENTINEL, Address, Parameter, integer, parameter, text
from pipros_ros2.rtps.qos import DurabilityKind, Qos, QosPolicy, ReliabilityKind, mismatch

PREFIX = bytes(range(12))
HERE = (Address("127.0.0.1", 7410), Address("10.0.0.1", 7410))


def test_participants_are_read_back() -> None:
    announced = ParticipantData(PREFIX, CYCLONE_DDS, 7.5, HERE, HERE[:1], b"enclave=/;")

    assert read_participant(write_participant(announced)) == announced


def test_an_infinite_lease_is_read_back() -> None:
    announced = ParticipantData(PREFIX, lease_s=math.inf, discovery=HERE, data=HERE)

    assert read_participant(write_participant(announced)) == announced


@pytest.mark.parametrize("is_writer_", [True, False])
@pytest.mark.parametrize("qos", [
    Qos(), Qos(ReliabilityKind.BEST_EFFORT, DurabilityKind.TRANSIENT_LOCAL, deadline_s=0.5, lease_s=2.0),
    Qos(representations=(0, 2)),
])  # fmt: skip
def test_endpoints_are_read_back(is_writer_: bool, qos: Qos) -> None:
    guid = PREFIX + user_entity(70_000, is_writer=is_writer_)
    announced = EndpointData(guid, "rt/a", "b::msg::dds_::C_", qos, b"typehash=RIHS01_00;", HERE)

    assert read_endpoint(write_endpoint(announced)) == announced
    assert announced.is_writer is is_writer(guid) is is_writer_


def test_unset_policies_have_the_defaults_of_dds() -> None:
    """Writers are reliable by default, readers are not."""
    for is_writer_, reliability in ((True, ReliabilityKind.RELIABLE), (False, ReliabilityKind.BEST_EFFORT)):
        guid = PREFIX + user_entity(1, is_writer=is_writer_)
        payload = (
            PARAMETER_LIST
            + parameter(Parameter.ENDPOINT_GUID, guid)
            + parameter(Parameter.TOPIC_NAME, text("rt/a"))
            + parameter(Parameter.TYPE_NAME, text("T"))
            + SENTINEL
        )
        found = read_endpoint(payload)
        assert found is not None
        assert found.qos == Qos(reliability, representations=())


@pytest.mark.parametrize(("names", "matches"), [([], True), ([""], True), (["*"], True), (["left"], False)])
def test_only_the_default_partition_matches(names: list[str], matches: bool) -> None:
    value = integer(len(names)) + b"".join(text(name) + bytes(-len(text(name)) % 4) for name in names)
    payload = write_endpoint(EndpointData(PREFIX + b"\0\0\1\3", "rt/a", "T", Qos()))
    found = read_endpoint(payload[:-4] + parameter(Parameter.PARTITION, value) + SENTINEL)
    assert found is not None

    assert found.qos.partitions == tuple(names)
    assert mismatch(found.qos, Qos()) is (None if matches else QosPolicy.PARTITION)


@pytest.mark.parametrize("size", [0, 3, 4, 20, 60])
def test_truncated_announcements_are_refused(size: int) -> None:
    assert read_participant(write_participant(ParticipantData(PREFIX, discovery=HERE))[:size]) is None
    assert read_endpoint(write_endpoint(EndpointData(PREFIX + b"\0\0\1\3", "a", "T", Qos()))[:size]) is None


def test_a_participant_without_an_address_is_refused() -> None:
    assert read_participant(write_participant(ParticipantData(PREFIX))) is None


def test_keys_are_read_back() -> None:
    guid = PREFIX + b"\0\0\1\3"

    assert read_key(write_key(Parameter.ENDPOINT_GUID, guid), Parameter.ENDPOINT_GUID) == guid
    assert read_key(write_key(Parameter.ENDPOINT_GUID, guid), Parameter.PARTICIPANT_GUID) is None
    assert read_key(b"", Parameter.ENDPOINT_GUID) is None


def test_entries_end_at_a_nul() -> None:
    assert (entries(b"enclave=/;\0"), entries(b"nothing")) == ({"enclave": "/"}, {})


def test_prefixes_are_random_and_have_the_vendor() -> None:
    assert new_prefix() != new_prefix()
    assert len(guid_text(new_prefix() + b"\0\0\1\3")) == 33


# Nodes on `ros_discovery_info`: nothing is published before the size of GIDs is known.


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
