"""Random ROS 2 messages, serialized by rosbags, and the same messages of ROS 1, serialized by their classes.

`python -m tests.support.ros2_samples --count 1000` compares the results of all conversions with them.
"""

import argparse
import io
import random
import sys
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pipros.msg import load_message_class
from pipros.msg.time import Duration, Time
from pipros_rosbag2.conversion.mapping import BUILTIN_RULES
from pipros_rosbag2.conversion.plans import Plans
from pipros_rosbag2.distribution import Distribution
from pipros_rosbag2.interfaces.catalog import Catalog, carried
from pipros_rosbag2.interfaces.installed import installed_definitions

_RANGES = {f"int{bits}": (-(1 << bits - 1), (1 << bits - 1) - 1) for bits in (8, 16, 32, 64)}
_RANGES |= {f"uint{bits}": (0, (1 << bits) - 1) for bits in (8, 16, 32, 64)}
_RANGES |= {"byte": (0, 127), "char": (0, 255), "bool": (0, 1)}  # byte has a sign in ROS 1 only
_TIMES = {"builtin_interfaces/msg/Time": Time, "builtin_interfaces/msg/Duration": Duration}
_ONLY_ROS2 = (
    "action_msgs builtin_interfaces rcl_interfaces rmw_dds_common service_msgs unique_identifier_msgs"
)


@cache
def plans_of(distribution: Distribution) -> Plans:
    """Return the plans for converting between the ROS 1 types in `share` and the types of a distribution."""
    ros1 = installed_definitions()
    return Plans(Catalog(distribution, ros1), ros1, BUILTIN_RULES)


@cache
def store_of(distribution: Distribution) -> Any:
    return get_typestore(getattr(Stores, f"ROS2_{distribution.name}"))


def shared_types(distribution: Distribution) -> list[str]:
    """Return the ROS 2 messages for which ROS 1 has a message with the same name, sorted."""
    names = (
        name for name in carried(distribution).messages if name.partition("/")[0] not in _ONLY_ROS2.split()
    )
    lonely = {"visualization_msgs/msg/MeshFile", "visualization_msgs/msg/UVCoordinate"}
    return sorted(set(names) - lonely)


class Samples:
    """Generates random messages of a distribution. The same seed yields the same messages."""

    def __init__(self, distribution: Distribution, seed: int) -> None:
        self._store = store_of(distribution)
        self._random = random.Random(seed)  # noqa: S311 # for tests

    def pair(self, ros2_type: str) -> tuple[bytes, bytes]:
        """Return a message of a shared type, serialized for ROS 1 and in CDR.

        Fields that only ROS 2 has are set to their defaults.
        """
        cls = load_message_class(ros2_type.replace("/msg/", "/"))
        values = self._message(ros2_type, cls)
        cdr = self._store.serialize_cdr(self._ros2(ros2_type, values), ros2_type)
        buffer = io.BytesIO()
        _ros1(cls, values).serialize(buffer)
        return buffer.getvalue(), bytes(cdr)

    def _message(self, name: str, cls: Any) -> dict[str, Any]:
        """Return random values by field. None stands for the field's default."""
        known = {each.lower(): kind for each, kind in zip(cls.__slots__, cls._slot_types, strict=True)}
        _, fields = self._store.fielddefs[name]
        return {field: self._field(kind, known.get(field)) for field, kind in fields}

    def _field(self, kind: Any, ros1: str | None) -> Any:
        node, argument = kind
        if ros1 is None:
            return None
        if node.name in ("BASE", "NAME"):
            return self._single(kind, ros1)
        inner, length = argument
        count = length if node.name == "ARRAY" else self._random.choice([0, 1, 2, 3, 5])
        if node.name == "SEQUENCE" and length:
            count = min(count, length)
        return [self._single(inner, ros1.partition("[")[0]) for _ in range(count)]

    def _single(self, kind: Any, ros1: str) -> Any:
        node, argument = kind
        if node.name == "NAME":
            if argument in _TIMES:
                return self._random.randrange(1 << 31), self._random.randrange(10**9)
            return self._message(argument, load_message_class(ros1))
        base = argument[0]
        if base == "string":
            return "".join(self._random.choice("abc é€/") for _ in range(self._random.randrange(9)))
        if base.startswith("float"):
            return float(np.float32(self._random.uniform(-1e6, 1e6)))
        return self._random.randint(*_RANGES[base])

    def _ros2(self, name: str, values: dict[str, Any]) -> Any:
        _, fields = self._store.fielddefs[name]
        return self._store.types[name](
            **{field: self._ros2_value(kind, values[field]) for field, kind in fields}
        )

    def _ros2_value(self, kind: Any, value: Any) -> Any:
        node, argument = kind
        if node.name == "NAME":
            if value is None:
                _, fields = self._store.fielddefs[argument]
                return self._ros2(argument, {field: None for field, _ in fields})
            if argument in _TIMES:
                return self._store.types[argument](sec=value[0], nanosec=value[1])
            return self._ros2(argument, value)
        if node.name == "BASE":
            return value if value is not None else "" if argument[0] == "string" else 0
        inner, length = argument
        values = value or []
        if value is None and node.name == "ARRAY":
            values = [None] * length
        made = [self._ros2_value(inner, each) for each in values]
        if inner[0].name == "BASE" and inner[1][0] != "string":
            base = inner[1][0]
            return np.array(made, dtype={"byte": "uint8", "char": "uint8"}.get(base, base))
        return made


def _ros1(cls: Any, values: dict[str, Any]) -> Any:
    made = cls()
    for field, kind in zip(cls.__slots__, cls._slot_types, strict=True):
        value = values.get(field, values.get(field.lower()))
        if value is not None:
            setattr(made, field, _ros1_value(kind, value))
    return made


def _ros1_value(kind: str, value: Any) -> Any:
    base, _, is_array = kind.partition("[")
    if is_array:
        made = [_ros1_value(base, each) for each in value]
        return bytes(made) if base in ("uint8", "char") else made
    if isinstance(value, tuple):
        return (Time if base == "time" else Duration)(*value)
    if isinstance(value, dict):
        return _ros1(load_message_class("std_msgs/Header" if base == "Header" else base), value)
    return bool(value) if base == "bool" else value


def differences(distribution: Distribution, count: int, seed: int = 1) -> Iterator[str]:
    """Convert `count` random messages of every shared type in both directions.

    Yield a description of each difference from the serialized messages of rosbags and ROS 1.
    """
    samples, plans = Samples(distribution, seed), plans_of(distribution)
    for name in shared_types(distribution):
        plan = plans.for_ros2(name)
        for _ in range(count):
            ros1, cdr = samples.pair(name)
            if plan.to_cdr(ros1) != cdr:
                yield f"{name} to CDR: {ros1.hex()} became {plan.to_cdr(ros1).hex()}, not {cdr.hex()}"
            if plan.to_ros1(cdr) != ros1:
                yield f"{name} to ROS 1: {cdr.hex()} became {plan.to_ros1(cdr).hex()}, not {ros1.hex()}"


def main() -> int:
    parser = argparse.ArgumentParser(description="Compare conversions to ROS 2 with rosbags.")
    parser.add_argument("--count", type=int, default=1000)
    count = parser.parse_args().count
    failed = False
    for distribution in Distribution:
        found = list(differences(distribution, count))
        types = len(shared_types(distribution))
        total = f"{distribution.value}: {types} types, {count} messages of each, {len(found)} differences"
        print(*(total, *found[:10]), sep="\n")
        failed |= bool(found)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
