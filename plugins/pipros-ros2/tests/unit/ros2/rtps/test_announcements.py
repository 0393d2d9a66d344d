"""Announcements of participants and endpoints: conversion to bytes and back."""

from __future__ import annotations

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
