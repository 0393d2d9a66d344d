"""What the compiler asks about types before it writes code for them."""

from __future__ import annotations

from collections.abc import Callable

from pipros.msg.digest import Lookup, embedded_types
from pipros.msg.spec import BUILTINS, NUMBERS, OCTETS, FieldType, MessageSpec

INLINE_ARRAY_LIMIT = 64
"""Fixed arrays of numbers up to this length are unpacked together with their neighbours."""


class Shapes:
    """Answers about the types that `lookup` knows; each is found once. No type may contain itself."""

    def __init__(self, lookup: Lookup) -> None:
        self._lookup = lookup
        self._takes_bytes: dict[str, bool] = {}
        self._is_one_unpack: dict[str, bool] = {}

    def has_octets(self, spec: MessageSpec) -> bool:
        """True when a variable array of octets is anywhere in the message."""
        inner = embedded_types(spec, self._lookup).values()
        return any(
            field.type.base in OCTETS and field.type.is_array and field.type.length is None
            for part in (spec, *inner)
            for field in part.fields
        )

    def takes_bytes(self, base: str) -> bool:
        """False for a type whose values take no bytes at all: an array of them never runs out."""
        return base in BUILTINS or self._asked(
            self._takes_bytes,
            base,
            lambda kind: (
                (kind.is_array and kind.length is None) or (kind.length != 0 and self.takes_bytes(kind.base))
            ),
            any,
        )

    def is_one_unpack(self, base: str) -> bool:
        """True when every value has the same size and comes out of one call of `struct`."""
        if base in BUILTINS:
            return base != "string"
        return self.takes_bytes(base) and self._asked(
            self._is_one_unpack,
            base,
            lambda kind: self._is_short(kind) if kind.is_array else self.is_one_unpack(kind.base),
            all,
        )

    def only_code(self, base: str) -> str | None:
        """The code of `struct` that all fields of a message share, when they are single numbers."""
        if base in BUILTINS:
            return None
        kinds = [field.type for field in self._lookup(base).fields]
        codes = {NUMBERS.get(kind.base, "") for kind in kinds}
        is_plain = all(kind.base in NUMBERS and kind.base != "bool" and not kind.is_array for kind in kinds)
        return codes.pop() if is_plain and len(codes) == 1 else None

    def _is_short(self, kind: FieldType) -> bool:
        if kind.length is None or kind.base not in NUMBERS:
            return False
        return kind.base in OCTETS or kind.length <= INLINE_ARRAY_LIMIT

    def _asked(
        self,
        known: dict[str, bool],
        base: str,
        question: Callable[[FieldType], bool],
        combined: Callable[..., bool],
    ) -> bool:
        if base not in known:
            known[base] = combined(question(field.type) for field in self._lookup(base).fields)
        return known[base]
