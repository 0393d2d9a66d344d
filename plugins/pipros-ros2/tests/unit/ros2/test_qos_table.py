"""The QoS of topics in the form of each engine."""

from __future__ import annotations

import itertools
import json
from dataclasses import fields

import pytest

from pipros_ros2.interface import Durability, Reliability, TopicQos
from pipros_ros2.qos_table import dds_qos, qos_of_dds, qos_of_rclpy, qos_of_zenoh, rclpy_qos, zenoh_qos
from pipros_ros2.rtps.qos import DurabilityKind, Qos

VALUES = {"reliability": Reliability, "durability": Durability, "depth": (0, 1, 10, 42, 1000)}


def test_every_field_of_a_qos_passes_through_every_engine() -> None:
    assert VALUES.keys() == {each.name for each in fields(TopicQos)}
    for values in itertools.product(*VALUES.values()):
        qos = TopicQos(**dict(zip(VALUES, values, strict=True)))

        assert qos_of_dds(dds_qos(qos)) == qos
        assert qos_of_rclpy(json.loads(json.dumps(rclpy_qos(qos)))) == qos
        assert qos_of_zenoh(zenoh_qos(qos)) == qos


@pytest.mark.parametrize(("qos", "text"), [
    (TopicQos(depth=42), "::,:,:,:,,"), (TopicQos(depth=10), "::,10:,:,:,,"),
    (TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1), ":1:,1:,:,:,,"),
    (TopicQos(Reliability.BEST_EFFORT, depth=5), "2::,5:,:,:,,"), (TopicQos(depth=0), "::2,:,:,:,,"),
])  # fmt: skip
def test_qos_has_rmw_zenohs_defaults(qos: TopicQos, text: str) -> None:
    assert zenoh_qos(qos) == text


@pytest.mark.parametrize("text", ["", "x", "9:9:9,-1", "::,99999999999999999999:", "::,\u0663:"])
def test_unknown_qos_counts_as_default(text: str) -> None:
    assert qos_of_zenoh(text) == TopicQos(depth=42)
    assert qos_of_rclpy({"reliability": text, "durability": text}) == TopicQos()


def test_durabilities_that_ros2_lacks_include_transient_local() -> None:
    assert qos_of_dds(Qos(durability=DurabilityKind.PERSISTENT)) == TopicQos(
        durability=Durability.TRANSIENT_LOCAL
    )
