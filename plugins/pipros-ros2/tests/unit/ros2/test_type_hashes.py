"""Type hashes against published ones, and against rosbags for every carried type."""

from __future__ import annotations

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.spec import DefinitionError
from pipros_ros2.rtps.announcements import entries
from pipros_ros2.rtps.graph_info import TYPE_HASH
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import carried
from pipros_rosbag2.interfaces.parse import parse_ros2_message
from pipros_rosbag2.interfaces.spec import Ros2Message
from pipros_rosbag2.interfaces.type_hash import message_hash
from tests.support.ros2_samples import plans_of, store_of

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD_TWO_INTS = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
"""Both are in the design document of rmw_zenoh."""

WITH_CHAR = {
    "std_msgs/msg/Char", "rmw_dds_common/msg/Gid", "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo", "service_msgs/msg/ServiceEventInfo",
}  # fmt: skip
"""rosbags gives `char` the number 13. That of uint8 gives the published hash of AddTwoInts."""


def test_hashes_equal_the_published_ones() -> None:
    plans = plans_of(Distribution.JAZZY)

    assert plans.message_hash("std_msgs/msg/String") == STRING
    assert plans.service_hash("example_interfaces/srv/AddTwoInts") == ADD_TWO_INTS


def test_the_topic_with_the_nodes_has_its_hash() -> None:
    found = plans_of(Distribution.JAZZY).message_hash("rmw_dds_common/msg/ParticipantEntitiesInfo")

    assert entries(TYPE_HASH) == {"typehash": found}


@pytest.mark.parametrize("distribution", Distribution)
def test_hashes_of_all_types_equal_those_of_rosbags(distribution: Distribution) -> None:
    store, plans = store_of(distribution), plans_of(distribution)
    names = (carried(distribution).messages & store.fielddefs.keys()) - WITH_CHAR

    assert len(names) > 120
    assert {name: plans.message_hash(name) for name in names} == {
        name: store.hash_rihs01(name) for name in names
    }


@pytest.mark.parametrize("distribution", Distribution)
def test_carried_constants_equal_those_of_rosbags(distribution: Distribution) -> None:
    store, catalog = store_of(distribution), plans_of(distribution).catalog
    for name in carried(distribution).messages & store.fielddefs.keys():
        constants, _ = store.fielddefs[name]
        ours = [(each.name, each.type, each.text.strip("\"'")) for each in catalog.message(name).constants]
        assert ours == [(constant, kind, str(value)) for constant, kind, value in constants], name


def test_defaults_and_comments_do_not_change_the_hash() -> None:
    plain = parse_ros2_message("int32 x\nstring<=5 s\nuint8[<=3] b", "a/msg/B")
    rich = parse_ros2_message('int32 x 5 # metres\nstring<=5 s "a # b"\nuint8[<=3] b [1, 2]', "a/msg/B")

    assert message_hash(plain, _unknown) == message_hash(rich, _unknown)


def test_a_type_that_contains_itself_has_no_hash() -> None:
    message = parse_ros2_message("B[] b", "a/msg/B")

    with pytest.raises(DefinitionError, match="cannot contain itself: a/msg/B"):
        message_hash(message, lambda _: message)


def _unknown(name: str) -> Ros2Message:
    raise NotFound(name)
