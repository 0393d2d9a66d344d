"""Compiled conversions of messages, services and actions between ROS 1 and CDR.

plans = Plans(Catalog(Distribution.JAZZY, ros1), ros1, BUILTIN_RULES)
plan = plans.for_ros1("sensor_msgs/Image")
cdr = plan.to_cdr(message_bytes)
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

from pipros.basics.limits import process_limits
from pipros.msg.base import Buffer
from pipros.msg.compile.run import run
from pipros.msg.language.digest import embedded_types
from pipros_rosbag2.conversion.errors import BoundExceeded, ConversionError
from pipros_rosbag2.conversion.generate import HEADER, converter_source
from pipros_rosbag2.conversion.mapping import MappingRules
from pipros_rosbag2.conversion.pairing import Pair, Pairing
from pipros_rosbag2.conversion.run_emitter import LENGTHS, PADS
from pipros_rosbag2.conversion.runs import check_count, patched
from pipros_rosbag2.interfaces.action_types import CANCEL_GOAL
from pipros_rosbag2.interfaces.catalog import Catalog, Ros1Definitions, embedded_messages
from pipros_rosbag2.interfaces.type_hash import ActionHashes, action_hashes, message_hash, service_hash

_Convert = Callable[[memoryview], list[Any]]

_TRAILING = 3
"""Maximum number of padding bytes that some vendors append to a message."""

_ENCODINGS = {b"\0\0": "big-endian CDR", b"\0\2": "big-endian PL_CDR", b"\0\3": "PL_CDR"}


class ConversionPlan:
    """Conversion of one message type in both directions, each compiled when it is first used.

    Attributes:
        ros1_type, ros2_type: the names, such as `std_msgs/String` and `std_msgs/msg/String`.
        only_ros1, only_ros2: the fields that the other side lacks.
    """

    def __init__(self, pair: Pair, pairing: Pairing) -> None:
        self._pair = pair
        self._pairing = pairing
        self.ros1_type = pair.ros1.type
        self.ros2_type = pair.ros2.type
        self.only_ros1 = pair.only_ros1
        self.only_ros2 = pair.only_ros2
        self._functions: dict[bool, _Convert] = {}

    def prepare(self, *, to_cdr: bool = True, to_ros1: bool = True) -> None:
        """Compile both directions, or one of them.

        Raises:
            NotConvertible: corresponding fields have incompatible types.
            DefinitionError: the types exceed a limit.
        """
        for is_to_cdr, is_needed in ((True, to_cdr), (False, to_ros1)):
            if is_needed:
                self._function(to_cdr=is_to_cdr)

    def to_cdr_parts(self, data: Buffer) -> list[Any]:
        """Return the CDR of a ROS 1 message as buffers, which may be views of `data`.

        Raises:
            ConversionError: the bytes are not a message of the type.
            BoundExceeded: a field is longer than ROS 2 allows.
        """
        return self._run(memoryview(data).cast("B").toreadonly(), to_cdr=True)

    def to_cdr(self, data: Buffer) -> bytes:
        """Return the CDR of a ROS 1 message. Raises the same errors as `to_cdr_parts`."""
        return b"".join(self.to_cdr_parts(data))

    def to_ros1_parts(self, cdr: Buffer) -> list[Any]:
        """Convert CDR to a ROS 1 message, as buffers, which may be views of `cdr`. `seq` in headers is 0.

        Raises:
            ConversionError: the bytes are not little-endian CDR of the type.
        """
        view = memoryview(cdr).cast("B").toreadonly()
        encoding = bytes(view[:2])
        if encoding != HEADER[:2] or len(view) < len(HEADER):
            found = _ENCODINGS.get(encoding, f"the header {bytes(view[:4]).hex() or 'of no bytes'}")
            raise ConversionError(
                f"{self.ros2_type}: expected the 4-byte header of little-endian CDR (0001…), got {found}"
            )
        return self._run(view[len(HEADER) :], to_cdr=False)

    def to_ros1(self, cdr: Buffer) -> bytes:
        """Convert CDR to a ROS 1 message. Raises the same errors as `to_ros1_parts`."""
        return b"".join(self.to_ros1_parts(cdr))

    def _run(self, data: memoryview, *, to_cdr: bool) -> list[Any]:
        try:
            return self._function(to_cdr=to_cdr)(data)
        except (struct.error, IndexError) as error:
            reason = f"the data are too short for the type: {error}"
        except ConversionError as error:
            raise type(error)(f"{self.ros1_type if to_cdr else self.ros2_type}: {error}") from None
        raise ConversionError(f"{self.ros1_type if to_cdr else self.ros2_type}: {reason}")

    def _function(self, *, to_cdr: bool) -> _Convert:
        if to_cdr not in self._functions:
            source, tables = converter_source(self._pair, self._pairing, process_limits(), to_cdr=to_cdr)
            end = _check_ros1_end if to_cdr else _check_cdr_end
            namespace = {**_NAMES, **tables, "_check_end": end}
            made = run(source, namespace, f"<conversion of {self.ros1_type}>")
            self._functions[to_cdr] = made["convert"]
        return self._functions[to_cdr]


@dataclass(frozen=True, slots=True)
class ServicePlan:
    """Conversion of a service."""

    ros1_type: str
    ros2_type: str
    request: ConversionPlan
    response: ConversionPlan


@dataclass(frozen=True, slots=True)
class ActionPlan:
    """Conversion of an action.

    Attributes:
        result: plan for messages that begin with the ROS 2 status of the goal (one byte) on both sides.
    """

    ros1_type: str
    ros2_type: str
    goal: ConversionPlan
    result: ConversionPlan
    feedback: ConversionPlan


class Plans:
    """Plans by type. Each plan is created once.

    Args:
        rules: see `mapping.merged`.
    """

    def __init__(self, catalog: Catalog, ros1: Ros1Definitions, rules: MappingRules) -> None:
        self.catalog = catalog
        self._ros1 = ros1
        self._pairing = Pairing(ros1.message, catalog, rules)
        self._plans: dict[tuple[str, str], ConversionPlan] = {}
        self._services: dict[str, ServicePlan] = {}
        self._actions: dict[tuple[str, str], ActionPlan] = {}

    def for_ros1(self, ros1_type: str) -> ConversionPlan:
        """Return the plan for a ROS 1 message, whose counterpart the rules determine.

        Raises:
            NotConvertible: no ROS 2 type corresponds, or the fields do not correspond.
            NotFound: the ROS 1 type, or an embedded type, is unknown.
            DefinitionError: a definition is invalid.
        """
        return self.between(ros1_type, self._pairing.ros2_type(ros1_type))

    def for_ros2(self, ros2_type: str) -> ConversionPlan:
        """Return the plan for a ROS 2 message. Raises the same errors as `for_ros1`."""
        return self.between(self._pairing.ros1_type(ros2_type), ros2_type)

    def between(self, ros1_type: str, ros2_type: str) -> ConversionPlan:
        """Return the plan for two messages. Raises the same errors as `for_ros1`."""
        key = ros1_type, ros2_type
        if key not in self._plans:
            self._plans[key] = self._plan(
                self._pairing.message(self._ros1.message(ros1_type), self.catalog.message(ros2_type))
            )
        return self._plans[key]

    def service(self, ros1_type: str) -> ServicePlan:
        """Return the plan for a ROS 1 service. Raises the same errors as `for_ros1`."""
        if ros1_type not in self._services:
            ros2_type = self._pairing.ros2_service(ros1_type)
            request, response = self._pairing.service(self._ros1.service(ros1_type), ros2_type)
            self._services[ros1_type] = ServicePlan(
                ros1_type, ros2_type, self._plan(request), self._plan(response)
            )
        return self._services[ros1_type]

    def ros1_service(self, ros2_type: str) -> str:
        """Return the ROS 1 service for a ROS 2 service.

        Raises:
            NotConvertible: no ROS 1 service corresponds.
        """
        return self._pairing.ros1_service(ros2_type, self._ros1.service)

    def action(self, ros1_type: str, ros2_type: str = "") -> ActionPlan:
        """Return the plan for a ROS 1 action (`package/Name`). Raises the same errors as `for_ros1`.

        Args:
            ros2_type: the ROS 2 action, instead of the one that the rules determine.
        """
        ros2_type = ros2_type or self._pairing.ros2_action(ros1_type)
        key = ros1_type, ros2_type
        if key not in self._actions:
            pairs = self._pairing.action(ros1_type, self.catalog.action(ros2_type))
            self._actions[key] = ActionPlan(*key, *map(self._plan, pairs))
        return self._actions[key]

    def ros2_actions(self, ros1_type: str) -> list[str]:
        """Return all ROS 2 actions for a ROS 1 action. Raises the same errors as `for_ros1`."""
        return self._pairing.ros2_actions(ros1_type)

    def ros1_action(self, ros2_type: str) -> str:
        """Return the ROS 1 action for a ROS 2 action.

        Raises:
            NotConvertible: no ROS 1 action corresponds.
        """
        return self._pairing.ros1_action(ros2_type)

    def _plan(self, pair: Pair) -> ConversionPlan:
        """Return the plan for a pair.

        Raises:
            NotFound: an embedded type is unknown.
            DefinitionError: a type contains itself, or messages are nested too deeply.
        """
        embedded_types(pair.ros1, self._ros1.message)
        embedded_messages(pair.ros2, self.catalog.message)
        return ConversionPlan(pair, self._pairing)

    def message_hash(self, ros2_type: str) -> str:
        """Return the type hash of a ROS 2 message."""
        return message_hash(self.catalog.message(ros2_type), self.catalog.message)

    def service_hash(self, ros2_type: str) -> str:
        """Return the type hash of a ROS 2 service."""
        return service_hash(self.catalog.service(ros2_type), self.catalog.message)

    def part_hashes(self, ros2_type: str) -> tuple[str, str]:
        """Return the type hashes of a service's request and response."""
        service, lookup = self.catalog.service(ros2_type), self.catalog.message
        return message_hash(service.request, lookup), message_hash(service.response, lookup)

    def action_hashes(self, ros2_type: str) -> ActionHashes:
        """Return the type hashes of a ROS 2 action."""
        action, cancel_goal = self.catalog.action(ros2_type), self.catalog.service(CANCEL_GOAL)
        return action_hashes(action, cancel_goal, self.catalog.message)


def _check_ros1_end(end: int, size: int) -> None:
    if end > size:
        raise ConversionError(f"the message must have at least {end} bytes, got {size}")


def _check_cdr_end(end: int, size: int) -> None:
    if not end <= size <= end + _TRAILING:
        raise ConversionError(
            f"the body must have {end} bytes and at most {_TRAILING} of padding, got {size}"
        )


def _raise_bound(count: int, bound: int) -> NoReturn:
    raise BoundExceeded(f"a field has a length of {count}, but ROS 2 allows at most {bound}")


def _raise_unterminated() -> NoReturn:
    raise ConversionError("a string must end with a zero byte")


_U32 = struct.Struct("<I")
_NAMES: dict[str, Any] = {
    "_check_count": check_count,
    "_header": HEADER,
    "_len": len,
    "_lengths": LENGTHS,
    "_nul": b"\0",
    "_p32": _U32.pack,
    "_pads": PADS,
    "_patched": patched,
    "_raise_bound": _raise_bound,
    "_raise_unterminated": _raise_unterminated,
    "_range": range,
    "_u32": _U32.unpack_from,
}
"""The names that generated code uses, in addition to its own tables."""
