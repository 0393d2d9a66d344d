"""Replace arrays or strings in messages with their sizes, for `--noarr` and `--nostr`."""

from __future__ import annotations

from typing import Any

from pipros.msg.base import Message
from pipros_tools.graph.message_path import Part


class Elision:
    """Replaces arrays and strings with their sizes. Messages inside arrays are left unchanged."""

    def __init__(self, *, no_arrays: bool, no_texts: bool) -> None:
        self._no_arrays = no_arrays
        self._no_texts = no_texts
        self._classes: dict[type[Message], type[Message]] = {}

    def of(self, part: Part) -> Any:
        """Return the value of a message part, or the text that replaces this value."""
        value, type_name = part.value, part.type_name or ""
        if self._is_replaced(type_name):
            kind, bracket, _ = type_name.partition("[")
            what = f"array type: {kind}," if bracket else "string"
            return f"<{what} length: {len(value)}>"
        if not isinstance(value, Message):
            return value
        short = object.__new__(self._class_for(type(value)))
        for name, kind in zip(value.__slots__, value._slot_types, strict=True):
            setattr(short, name, self.of(Part(getattr(value, name), kind)))
        return short

    def _is_replaced(self, type_name: str) -> bool:
        """Return whether fields of a type are replaced. As in rostopic, `--nostr` includes `string[]`."""
        if self._no_texts and type_name in ("string", "string[]"):
            return True
        return self._no_arrays and type_name.endswith("]")

    def _class_for(self, original: type[Message]) -> type[Message]:
        """Return a class with the same fields, in which the replaced fields are strings."""
        if original not in self._classes:
            self._classes[original] = type(
                original.__name__,
                (Message,),
                {
                    "__slots__": list(original.__slots__),
                    "_type": original._type,
                    "_slot_types": [
                        "string" if self._is_replaced(kind) else kind for kind in original._slot_types
                    ],
                },
            )
        return self._classes[original]
