"""Describe message types for decoders in the browser: names, types and array lengths of all fields."""

from __future__ import annotations

from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg.language.full_text import specs_from_text

Layout = dict[str, list[list[Any]]]
"""Fields of each type, as `[name, base type, array]`; array is -1 (none), 0 (any length) or length + 1."""

SCALAR, ANY_LENGTH = -1, 0


def message_layout(type_name: str, full_text: str) -> Layout:
    """Return the layout of a type and of all embedded types.

    Args:
        full_text: the publisher's definition, from its connection header.

    Raises:
        PiprosError: the definition is invalid or recursive, or lacks an embedded type.
    """
    specs = specs_from_text(type_name, full_text)
    layout: Layout = {}
    for name, spec in specs.items():
        layout[name] = []
        for field in spec.fields:
            kind = field.type
            if not kind.is_builtin and kind.base not in specs:
                raise PiprosError(f"the definition of {type_name} lacks the type {kind.base}")
            array = SCALAR if not kind.is_array else ANY_LENGTH if kind.length is None else kind.length + 1
            layout[name].append([field.name, kind.base, array])
    _check_circles(layout, type_name, ())
    return layout


def _check_circles(layout: Layout, name: str, above: tuple[str, ...]) -> None:
    if name in above:
        raise PiprosError(f"the type {name} contains itself")
    for _, base, _ in layout.get(name, ()):
        if base in layout:
            _check_circles(layout, base, (*above, name))
