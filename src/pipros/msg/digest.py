"""The md5 and the full text of a type, as genmsg computes them.

Two peers exchange messages only when their md5s are equal, so both are part of the wire
protocol. `Lookup` gives the definition of a type that another one embeds.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator

from pipros.msg.spec import DefinitionError, Field, MessageSpec, ServiceSpec, UnknownType

Lookup = Callable[[str], MessageSpec]

SEPARATOR = "=" * 80
"""Stands between the definitions of a full text."""

DEPTH_LIMIT = 100
"""The deepest nesting of messages. Real types stay below ten."""


def embedded_types(spec: MessageSpec, lookup: Lookup) -> dict[str, MessageSpec]:
    """All types that `spec` embeds, directly or not, in the order of a full text.

    Raises:
        DefinitionError: for an unknown type, a type that embeds itself, and nesting that is too
            deep, at the field that leads there.
    """
    found: dict[str, MessageSpec] = {}
    finished: set[str] = set()

    def visit(outer: MessageSpec, above: tuple[str, ...]) -> None:
        for field in _message_fields(outer):
            type_name = field.type.base
            if type_name in above:
                cycle = " -> ".join((*above[above.index(type_name) :], type_name))
                raise _at(outer, field, f"a message cannot contain itself: {cycle}")
            if type_name in finished:
                continue
            if len(above) > DEPTH_LIMIT:
                raise _at(outer, field, f"messages are nested deeper than {DEPTH_LIMIT}")
            try:
                inner = lookup(type_name)
            except LookupError as error:
                reason = f"unknown type [{type_name}]: {error}"
                raise _at(outer, field, reason, UnknownType) from None
            found[type_name] = inner
            visit(inner, (*above, type_name))
            finished.add(type_name)

    visit(spec, (spec.type,))
    return found


def md5_text(spec: MessageSpec, lookup: Lookup) -> str:
    """The normalised text that the md5 is taken of: constants first, then fields.

    An embedded message stands there as its md5, so that its fields count and its name does not.
    """
    return _md5_text(spec, embedded_types(spec, lookup), {})


def message_md5(spec: MessageSpec, lookup: Lookup) -> str:
    """The md5 that peers compare before they exchange messages of this type."""
    return _hash(md5_text(spec, lookup))


def service_md5(spec: ServiceSpec, lookup: Lookup) -> str:
    """The md5 of a service: over both halves, with nothing in between."""
    return _hash(md5_text(spec.request, lookup) + md5_text(spec.response, lookup))


def full_text(spec: MessageSpec, lookup: Lookup) -> str:
    """The definition followed by those of all types it embeds, each once."""
    parts = [spec.text]
    for type_name, inner in embedded_types(spec, lookup).items():
        parts.append(f"{SEPARATOR}\nMSG: {type_name}\n{inner.text}")
    return "\n".join(parts)


def _md5_text(spec: MessageSpec, embedded: dict[str, MessageSpec], md5s: dict[str, str]) -> str:
    lines = [f"{constant.type} {constant.name}={constant.text}" for constant in spec.constants]
    for field in spec.fields:
        if field.type.is_builtin:
            lines.append(f"{field.type} {field.name}")
            continue
        type_name = field.type.base
        if type_name not in md5s:
            md5s[type_name] = _hash(_md5_text(embedded[type_name], embedded, md5s))
        lines.append(f"{md5s[type_name]} {field.name}")
    return "\n".join(lines)


def _message_fields(spec: MessageSpec) -> Iterator[Field]:
    return (field for field in spec.fields if not field.type.is_builtin)


def _hash(text: str) -> str:
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def _at(
    spec: MessageSpec, field: Field, reason: str, kind: type[DefinitionError] = DefinitionError
) -> DefinitionError:
    return kind(reason, file=spec.file, line=field.line, column=field.column)
