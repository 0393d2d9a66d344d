"""The MD5 sum and the full text of a type, computed as in genmsg.

Two peers exchange messages only if their MD5 sums are equal, so MD5 sums are part of the wire protocol. A
`Lookup` returns the definition of an embedded type.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from pipros.msg.language.spec import DefinitionError, Field, MessageSpec, ServiceSpec, UnknownType

Lookup = Callable[[str], MessageSpec]

SEPARATOR = "=" * 80
"""The line between the definitions in a full text."""

DEPTH_LIMIT = 100
"""Maximum nesting depth of messages. Real types stay below ten."""


def embedded_types(spec: MessageSpec, lookup: Lookup) -> dict[str, MessageSpec]:
    """Return all types that `spec` embeds, directly or indirectly, in the order of a full text.

    Raises:
        DefinitionError: a type is unknown, embeds itself or is nested too deeply. The exception contains the
            position of the field that embeds this type.
    """
    search = _Search(lookup)
    search.height(spec, (spec.type,))
    return search.found


@dataclass(frozen=True, slots=True)
class CompleteSpec:
    """A definition and the definitions of all embedded types, in the order of a full text."""

    spec: MessageSpec
    embedded: Mapping[str, MessageSpec]

    def md5_text(self) -> str:
        """Return the normalized text from which the MD5 sum is computed: constants first, then fields.

        The type of an embedded message is replaced by its MD5 sum, so the message's fields matter but its
        name does not.
        """
        return _md5_text(self.spec, self.embedded, {})

    def md5(self) -> str:
        """Return the MD5 sum that peers compare before they exchange messages of this type."""
        return _hash(self.md5_text())

    def full_text(self) -> str:
        """Return the definition, followed by the definition of each embedded type, without repetitions."""
        parts = [self.spec.text]
        for type_name, inner in self.embedded.items():
            parts.append(f"{SEPARATOR}\nMSG: {type_name}\n{inner.text}")
        return "\n".join(parts)


def complete(spec: MessageSpec, lookup: Lookup) -> CompleteSpec:
    """Look up all types that `spec` embeds. Raises the same errors as `embedded_types`."""
    return CompleteSpec(spec, embedded_types(spec, lookup))


def check_nesting(specs: Iterable[MessageSpec], lookup: Lookup) -> None:
    """Check that no message in `specs` contains itself or is nested too deeply, visiting each type once.

    Raises the same errors as `embedded_types`.
    """
    search = _Search(lookup)
    for spec in specs:
        search.height(spec, (spec.type,))


class _Search:
    """Depth-first search through embedded types, which visits each type once."""

    def __init__(self, lookup: Lookup) -> None:
        self._lookup = lookup
        self.found: dict[str, MessageSpec] = {}
        self._heights: dict[str, int] = {}

    def height(self, outer: MessageSpec, above: tuple[str, ...]) -> int:
        """Return how deeply messages are nested in `outer`: 0 if it contains no messages.

        `above` contains the types on the path to `outer`, including `outer` itself.
        """
        highest = 0
        for field in _message_fields(outer):
            type_name = field.type.base
            if type_name in above:
                cycle = " -> ".join((*above[above.index(type_name) :], type_name))
                raise _at(outer, field, f"a message cannot contain itself: {cycle}")
            if len(above) + self._heights.get(type_name, 1) - 1 > DEPTH_LIMIT:
                raise _at(outer, field, f"messages are nested deeper than {DEPTH_LIMIT}")
            if type_name not in self._heights:
                try:
                    inner = self._lookup(type_name)
                except LookupError as error:
                    reason = f"unknown type [{type_name}]: {error}"
                    raise _at(outer, field, reason, UnknownType) from None
                self.found[type_name] = inner
                self._heights[type_name] = 1 + self.height(inner, (*above, type_name))
            highest = max(highest, self._heights[type_name])
        return highest


def md5_text(spec: MessageSpec, lookup: Lookup) -> str:
    """Return the text from which a message's MD5 sum is computed.

    Raises the same errors as `embedded_types`.
    """
    return complete(spec, lookup).md5_text()


def message_md5(spec: MessageSpec, lookup: Lookup) -> str:
    """Return the MD5 sum of a message. Raises the same errors as `embedded_types`."""
    return complete(spec, lookup).md5()


def service_md5(spec: ServiceSpec, lookup: Lookup) -> str:
    """Return the MD5 sum of a service. Raises the same errors as `embedded_types`."""
    return md5_of_halves(complete(spec.request, lookup), complete(spec.response, lookup))


def md5_of_halves(request: CompleteSpec, response: CompleteSpec) -> str:
    """Return the MD5 sum of a service, computed from the request's text followed by the response's."""
    return _hash(request.md5_text() + response.md5_text())


def full_text(spec: MessageSpec, lookup: Lookup) -> str:
    """Return the full text of a message. Raises the same errors as `embedded_types`."""
    return complete(spec, lookup).full_text()


def _md5_text(spec: MessageSpec, embedded: Mapping[str, MessageSpec], md5s: dict[str, str]) -> str:
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
