"""Compute the properties of message types that determine the generated code."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

from pipros.msg.language.digest import Lookup
from pipros.msg.language.spec import BUILTINS, NUMBERS, OCTETS, TIMES, FieldType, MessageSpec

MESSAGE_VALUES = 4 * 1024 * 1024
"""Limit: values in a new message. Beyond it, the definition is refused."""

INLINE_ARRAY_LIMIT = 64
"""Maximum length of fixed arrays of numbers that are unpacked together with their neighbours."""

_LENGTH_BYTES = 4
_VALUES_PER_BYTE = 8
"""Number of values allowed per byte.

This is enough for a boolean (one byte) that is the only field of a message nested two levels deep.
"""


@dataclass(frozen=True, slots=True)
class TypeLayout:
    """A message type, and the properties that determine the code that reads and writes it.

    Attributes:
        spec: the definition of the type.
        members: the layouts of the fields' message types, by type name.
        has_octets: whether the type contains a variable-length array of octets at any depth.
        takes_bytes: whether serialized messages are non-empty. If not, the serialized size of an array of
            such messages does not depend on its length.
        is_one_unpack: whether a single `struct` call can read a message: all fields have fixed sizes, and
            arrays are short or contain octets.
        only_code: the `struct` code of all fields, if they are single numbers of one type; otherwise None.
        field_count: number of fields, including the fields of each embedded message and the elements of
            arrays that are unpacked with their neighbours.
        value_count: number of values in a new message. Each field and each embedded message counts as a
            value; eight octets of an array count as one value.
        least_bytes: the size of a new message when serialized, which is the minimum size.
    """

    spec: MessageSpec
    members: Mapping[str, TypeLayout]
    has_octets: bool
    takes_bytes: bool
    is_one_unpack: bool
    only_code: str | None
    field_count: int
    value_count: int
    least_bytes: int

    @property
    def code_size(self) -> int:
        """Size of the type's code, counted in fields and constants."""
        return len(self.spec.constants) + self.field_count

    @property
    def unpaid_values(self) -> int:
        """Minimum number of values by which a message exceeds the budget of eight values per serialized byte.

        If nonzero, an array of such messages uses more memory than its serialized size suggests. It is 0 for
        most types.
        """
        return _unpaid(self.value_count, self.least_bytes)

    @property
    def unpaid_values_of_element(self) -> int:
        """Like `unpaid_values`, but for a message in an array, where the message itself is also a value."""
        return _unpaid(self.value_count + 1, self.least_bytes)


class TypeLayouts:
    """Layouts by type. The layouts of embedded types are cached. No type may contain itself."""

    def __init__(self, lookup: Lookup) -> None:
        self._lookup = lookup
        self._known: dict[str, TypeLayout] = {}

    def of(self, spec: MessageSpec) -> TypeLayout:
        """Return the layout of a type. `lookup` must find all embedded types, but need not find this type."""
        members: dict[str, TypeLayout] = {}
        for field in spec.fields:
            base = field.type.base
            if base in BUILTINS or base in members:
                continue
            if base not in self._known:
                self._known[base] = self.of(self._lookup(base))
            members[base] = self._known[base]
        return _layout(spec, members)


def _layout(spec: MessageSpec, members: Mapping[str, TypeLayout]) -> TypeLayout:
    kinds = [field.type for field in spec.fields]
    takes_bytes = any(_takes_bytes(kind, members) for kind in kinds)
    value_count, least_bytes = _extent(kinds, members)
    return TypeLayout(
        spec=spec,
        members=members,
        has_octets=any(_has_octets(kind, members) for kind in kinds),
        takes_bytes=takes_bytes,
        is_one_unpack=takes_bytes and all(_is_one_unpack(kind, members) for kind in kinds),
        only_code=_only_code(kinds),
        field_count=sum(_field_count(kind, members) for kind in kinds),
        value_count=value_count,
        least_bytes=least_bytes,
    )


def _has_octets(kind: FieldType, members: Mapping[str, TypeLayout]) -> bool:
    if kind.is_builtin:
        return kind.base in OCTETS and kind.is_array and kind.length is None
    return members[kind.base].has_octets


def _takes_bytes(kind: FieldType, members: Mapping[str, TypeLayout]) -> bool:
    if kind.is_array and kind.length is None:
        return True
    return kind.length != 0 and (kind.is_builtin or members[kind.base].takes_bytes)


def _is_one_unpack(kind: FieldType, members: Mapping[str, TypeLayout]) -> bool:
    if kind.is_array:
        return _is_inline(kind)
    return kind.base != "string" if kind.is_builtin else members[kind.base].is_one_unpack


def _is_inline(kind: FieldType) -> bool:
    """Return True for a fixed array that is unpacked together with its neighbours."""
    if kind.length is None or kind.base not in NUMBERS:
        return False
    return kind.base in OCTETS or kind.length <= INLINE_ARRAY_LIMIT


def _only_code(kinds: list[FieldType]) -> str | None:
    is_plain = all(kind.base in NUMBERS and kind.base != "bool" and not kind.is_array for kind in kinds)
    codes = {NUMBERS[kind.base] for kind in kinds} if is_plain else set[str]()
    return codes.pop() if len(codes) == 1 else None


def _field_count(kind: FieldType, members: Mapping[str, TypeLayout]) -> int:
    if not kind.is_builtin:
        return 2 + members[kind.base].field_count
    has_elements = _is_inline(kind) and kind.base not in OCTETS
    return 1 + kind.length if has_elements and kind.length is not None else 1


def _extent(kinds: list[FieldType], members: Mapping[str, TypeLayout]) -> tuple[int, int]:
    """Return the number of values in a new message, and its serialized size."""
    values = size = 0
    for kind in kinds:
        values += 1
        if kind.is_array and kind.length is None:
            size += _LENGTH_BYTES
            continue
        count = kind.length if kind.length is not None else 1
        if kind.is_builtin:
            code = NUMBERS.get(kind.base) or TIMES.get(kind.base)
            inner_values, inner_size = 1, struct.calcsize(f"<{code}") if code else _LENGTH_BYTES
        else:
            inner_values, inner_size = members[kind.base].value_count + 1, members[kind.base].least_bytes
        is_octets = kind.is_array and kind.base in OCTETS
        values += count // 8 if is_octets else count * inner_values
        size += count * inner_size
    return values, size


def _unpaid(values: int, size: int) -> int:
    return max(0, values - _VALUES_PER_BYTE * size)
