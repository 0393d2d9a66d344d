"""Plans for reading messages as columns, created from message definitions.

A plan is a sequence of steps: runs of values at fixed offsets, and parts whose sizes are stored in the
messages. Fields of embedded messages become fields of the outer message, with dotted names. Fields that take
no bytes have no column.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from pipros.basics.limits import limit_text, process_limits
from pipros.msg.compile.layout import TypeLayout, TypeLayouts
from pipros.msg.dynamic import checked_specs
from pipros.msg.language.digest import embedded_types
from pipros.msg.language.spec import NUMBERS, TIMES, DefinitionError, FieldType, MessageSpec

LENGTH = np.dtype("<u4")
_MAX_BYTES = 1 << 30
"""Limit on `MessagePlan.least_bytes`. Real messages are much smaller."""


@dataclass(frozen=True, slots=True)
class FixedField:
    """A number or time, or a fixed array of them, at an offset in a run.

    Attributes:
        base: the primitive type.
        length: the length of a fixed array; None for a single value.
    """

    name: str
    base: str
    length: int | None
    offset: int

    @property
    def dtype(self) -> np.dtype[Any]:
        one = value_dtype(self.base)
        return one if self.length is None else np.dtype((one, (self.length,)))


@dataclass(frozen=True, slots=True)
class FixedRun:
    """Fields at fixed offsets in a run of bytes. `dtype` is a structured type with these fields."""

    fields: tuple[FixedField, ...]
    dtype: np.dtype[Any]


@dataclass(frozen=True, slots=True)
class SizedPart:
    """A part whose size is stored in the message, or an array of messages or strings.

    Attributes:
        base: `string`, or the type of the elements.
        is_array: whether the part is an array; if not, it is a string.
        length: the length of a fixed array.
        element: the plan for the elements, if they are messages or strings.
    """

    name: str
    base: str
    is_array: bool
    length: int | None = None
    element: MessagePlan | None = None


STRING = SizedPart("", "string", False)
"""The only step of the plan for the elements of string arrays."""

PlanStep: TypeAlias = "FixedRun | SizedPart"


@dataclass(frozen=True, slots=True)
class MessagePlan:
    """The steps for reading messages of one type.

    Attributes:
        type: the name of the type.
        steps: the steps, in the order of the fields.
        size: the size of a message in bytes; None if it varies.
        least_bytes: the minimum size of a message.
    """

    type: str
    steps: tuple[PlanStep, ...]
    size: int | None
    least_bytes: int


def plan_of(type_name: str, definition: str) -> MessagePlan:
    """Return the plan for a type, from its full definition.

    Raises:
        DefinitionError: the definition is invalid or exceeds the limits.
    """
    return plan_of_specs(checked_specs(type_name, definition), type_name)


def plan_of_specs(specs: Mapping[str, MessageSpec], type_name: str) -> MessagePlan:
    """Return the plan for a type, from the definitions of all types. Raises the same errors as `plan_of`."""
    spec = specs[type_name]
    embedded_types(spec, specs.__getitem__)  # raises an error if a type contains itself
    layout = TypeLayouts(specs.__getitem__).of(spec)
    limit = process_limits().definition_fields
    if layout.code_size > limit:
        reason = (
            f"the message has {layout.code_size} fields in total; {limit_text('definition_fields', limit)}"
        )
        raise DefinitionError(reason, file=spec.file)
    return _Planner().plan(layout)


def value_dtype(base: str) -> np.dtype[Any]:
    """Return the dtype of a number, or of the two numbers of a time. A boolean is a byte."""
    if base in TIMES:
        code = TIMES[base][0]
        return np.dtype((f"<{'u' if code == 'I' else 'i'}4", (2,)))
    return np.dtype("u1" if base == "bool" else f"<{NUMBERS[base]}")


class _Planner:
    def __init__(self) -> None:
        self._plans: dict[str, MessagePlan] = {}
        self._text = MessagePlan("string", (STRING,), None, LENGTH.itemsize)

    def plan(self, layout: TypeLayout) -> MessagePlan:
        name = layout.spec.type
        if name not in self._plans:
            if layout.least_bytes > _MAX_BYTES:
                reason = f"a message takes at least {layout.least_bytes} bytes; the limit is {_MAX_BYTES}"
                raise DefinitionError(reason, file=layout.spec.file)
            steps = _Steps()
            self._add(steps, layout, "")
            done = steps.finished()
            self._plans[name] = MessagePlan(name, done, _size_of(done), layout.least_bytes)
        return self._plans[name]

    def _add(self, steps: _Steps, layout: TypeLayout, prefix: str) -> None:
        for field in layout.spec.fields:
            kind, name = field.type, f"{prefix}{field.name}"
            if kind.is_builtin:
                steps.add(name, kind, self._text)
            elif not layout.members[kind.base].takes_bytes:
                if kind.is_array and kind.length is None:
                    steps.add_part(SizedPart(name, kind.base, True))
            elif kind.is_array:
                if kind.length != 0:
                    element = self.plan(layout.members[kind.base])
                    steps.add_part(SizedPart(name, kind.base, True, kind.length, element))
            else:
                self._add(steps, layout.members[kind.base], f"{name}.")


class _Steps:
    """The steps of a plan under construction."""

    def __init__(self) -> None:
        self._done: list[PlanStep] = []
        self._fields: list[FixedField] = []
        self._size = 0

    def add(self, name: str, kind: FieldType, text: MessagePlan) -> None:
        """Add a field of a primitive type."""
        if kind.length == 0:
            return
        if kind.base == "string":
            self.add_part(SizedPart(name, "string", kind.is_array, kind.length, text))
        elif kind.is_array and kind.length is None:
            self.add_part(SizedPart(name, kind.base, True))
        else:
            size = value_dtype(kind.base).itemsize * (1 if kind.length is None else kind.length)
            self._fields.append(FixedField(name, kind.base, kind.length, self._size))
            self._size += size

    def add_part(self, part: SizedPart) -> None:
        self._end_run()
        self._done.append(part)

    def finished(self) -> tuple[PlanStep, ...]:
        self._end_run()
        return tuple(self._done)

    def _end_run(self) -> None:
        if not self._fields:
            return
        layout = {
            "names": [field.name for field in self._fields],
            "formats": [field.dtype for field in self._fields],
            "offsets": [field.offset for field in self._fields],
            "itemsize": self._size,
        }
        self._done.append(FixedRun(tuple(self._fields), np.dtype(layout)))  # type: ignore[call-overload]
        self._fields, self._size = [], 0


def _size_of(steps: tuple[PlanStep, ...]) -> int | None:
    size = 0
    for step in steps:
        if isinstance(step, FixedRun):
            size += step.dtype.itemsize
        elif step.length is None or step.element is None or step.element.size is None:
            return None
        else:
            size += step.length * step.element.size
    return size
