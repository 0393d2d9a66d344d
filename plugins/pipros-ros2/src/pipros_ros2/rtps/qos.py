"""Quality of service of endpoints, and which writers and readers match."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final


class ReliabilityKind(IntEnum):
    """The reliability policy, with its values on the wire."""

    BEST_EFFORT = 1
    RELIABLE = 2


class DurabilityKind(IntEnum):
    """The durability policy, with its values on the wire.

    TRANSIENT and PERSISTENT need a storage service; ROS 2 does not use them.
    """

    VOLATILE = 0
    TRANSIENT_LOCAL = 1
    TRANSIENT = 2
    PERSISTENT = 3


class Liveliness(IntEnum):
    """The liveliness policy, with its values on the wire."""

    AUTOMATIC = 0
    MANUAL_BY_PARTICIPANT = 1
    MANUAL_BY_TOPIC = 2


class QosPolicy(Enum):
    """A policy that can keep a writer and a reader from matching, with its name in ROS 2."""

    RELIABILITY = "reliability"
    DURABILITY = "durability"
    DEADLINE = "deadline"
    LIVELINESS = "liveliness"
    OWNERSHIP = "ownership"
    PARTITION = "partition"
    REPRESENTATION = "data representation"

    @property
    def reason(self) -> str:
        """Why endpoints that differ in this policy do not match, and what to change."""
        is_set_by_rules = self in (QosPolicy.RELIABILITY, QosPolicy.DURABILITY)
        remedy = "set `qos` in a static rule, or change its node" if is_set_by_rules else "change its node"
        return f"its QoS is incompatible ({self.value}); {remedy}"


XCDR1: Final = 0
SHARED_OWNERSHIP: Final = 0


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service that a writer offers or a reader requests.

    Attributes:
        depth: number of samples that a writer keeps, or that wait at a reader; 0 means as many as the
            limits in bytes allow.
        deadline_s: maximum time between two samples.
        lease_s: maximum time between two signs of life from a writer.
        partitions: names or patterns; empty means the default partition, the only one that ROS 2 uses.
        representations: data representations that a writer offers, in order of preference, or that a reader
            understands; empty means XCDR1.
    """

    reliability: ReliabilityKind = ReliabilityKind.RELIABLE
    durability: DurabilityKind = DurabilityKind.VOLATILE
    depth: int = 10
    deadline_s: float = math.inf
    liveliness: Liveliness = Liveliness.AUTOMATIC
    lease_s: float = math.inf
    ownership: int = SHARED_OWNERSHIP
    partitions: tuple[str, ...] = ()
    representations: tuple[int, ...] = (XCDR1,)

    @property
    def is_reliable(self) -> bool:
        return self.reliability is ReliabilityKind.RELIABLE

    @property
    def is_latched(self) -> bool:
        """True if late readers get, or request, earlier samples."""
        return self.durability is not DurabilityKind.VOLATILE


def mismatch(offered: Qos, requested: Qos) -> QosPolicy | None:
    """Return the first policy of an offer that does not satisfy a request, or None if all policies do."""
    representation = offered.representations[0] if offered.representations else XCDR1
    checks = (
        (QosPolicy.RELIABILITY, offered.reliability >= requested.reliability),
        (QosPolicy.DURABILITY, offered.durability >= requested.durability),
        (QosPolicy.DEADLINE, offered.deadline_s <= requested.deadline_s),
        (
            QosPolicy.LIVELINESS,
            offered.liveliness >= requested.liveliness and offered.lease_s <= requested.lease_s,
        ),
        (QosPolicy.OWNERSHIP, offered.ownership == requested.ownership),
        (QosPolicy.PARTITION, _share_partition(offered.partitions, requested.partitions)),
        (QosPolicy.REPRESENTATION, representation in (requested.representations or (XCDR1,))),
    )
    return next((policy for policy, is_met in checks if not is_met), None)


def _share_partition(one: tuple[str, ...], other: tuple[str, ...]) -> bool:
    """Return whether both contain the default partition, the only one that pipros's endpoints use."""
    return _has_default(one) and _has_default(other)


def _has_default(partitions: tuple[str, ...]) -> bool:
    return not partitions or any(not name.strip("*") for name in partitions)
