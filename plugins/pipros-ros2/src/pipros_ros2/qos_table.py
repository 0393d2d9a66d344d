"""The QoS policies of topics in the form of each engine: all conversions follow from one table."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Any, Final, Generic, TypeVar

from pipros_ros2.interface import Durability, Reliability, TopicQos
from pipros_ros2.rtps.qos import DurabilityKind, Qos, ReliabilityKind

_Value = TypeVar("_Value", bound=Enum)
_Dds = TypeVar("_Dds", bound=Enum)


class PolicyForms(Generic[_Value, _Dds]):
    """A policy. Each row is a value, whose name rclpy uses, too, with its forms for DDS and rmw_zenoh.

    The first row is the default, which rmw_zenoh omits, and which replaces unknown values.
    """

    def __init__(self, *rows: tuple[_Value, _Dds, str]) -> None:
        self._default = rows[0][0]
        self.dds = {value: dds for value, dds, _ in rows}
        self.zenoh = {value: token for value, _, token in rows}
        self._of = {form: value for value, *forms in rows for form in (value.value, *forms)}

    def of(self, form: object) -> _Value:
        """Return the value with a form in any engine."""
        return self._of.get(form, self._default)


RELIABILITY: Final = PolicyForms(
    (Reliability.RELIABLE, ReliabilityKind.RELIABLE, ""),
    (Reliability.BEST_EFFORT, ReliabilityKind.BEST_EFFORT, "2"),
)
DURABILITY: Final = PolicyForms(
    (Durability.VOLATILE, DurabilityKind.VOLATILE, ""),
    (Durability.TRANSIENT_LOCAL, DurabilityKind.TRANSIENT_LOCAL, "1"),
)
ZENOH_DEPTH: Final = 42
"""The default depth of rmw_zenoh."""
_KEEP_ALL: Final = "2"


def dds_qos(qos: TopicQos) -> Qos:
    return Qos(RELIABILITY.dds[qos.reliability], DURABILITY.dds[qos.durability], depth=qos.depth)


def qos_of_dds(qos: Qos) -> TopicQos:
    """Return the QoS of an endpoint. Durabilities that ROS 2 lacks include transient_local."""
    durability = min(qos.durability, DurabilityKind.TRANSIENT_LOCAL)
    return TopicQos(RELIABILITY.of(qos.reliability), DURABILITY.of(durability), qos.depth)


def rclpy_qos(qos: TopicQos) -> dict[str, Any]:
    """Return a QoS as the agent of rclpy expects it."""
    return {"reliability": qos.reliability.value, "durability": qos.durability.value, "depth": qos.depth}


def qos_of_rclpy(words: Mapping[str, Any]) -> TopicQos:
    """Return a QoS that the agent of rclpy reports, if need be without depth."""
    reliability, durability = RELIABILITY.of(words.get("reliability")), DURABILITY.of(words.get("durability"))
    return TopicQos(reliability, durability, words.get("depth", TopicQos().depth))


def zenoh_qos(qos: TopicQos) -> str:
    """Return the QoS part of a token of rmw_zenoh."""
    history = "" if qos.depth else _KEEP_ALL
    depth = "" if qos.depth in (0, ZENOH_DEPTH) else qos.depth
    reliability, durability = RELIABILITY.zenoh[qos.reliability], DURABILITY.zenoh[qos.durability]
    return f"{reliability}:{durability}:{history},{depth}:,:,:,,"


def qos_of_zenoh(text: str) -> TopicQos:
    """Parse the QoS part of a token. Unknown values are treated as defaults."""
    reliability, durability, history, *_ = [*text.split(":"), "", "", ""]
    kind, _, depth = history.partition(",")
    is_number = depth.isascii() and depth.isdigit() and len(depth) < 10
    return TopicQos(
        RELIABILITY.of(reliability),
        DURABILITY.of(durability),
        0 if kind == _KEEP_ALL else int(depth) if is_number else ZENOH_DEPTH,
    )
