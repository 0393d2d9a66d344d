"""Messages as YAML templates, for shell completion of `rostopic pub /topic type`."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import yaml

from pipros.msg import load_message_class
from pipros.msg.base import Message
from pipros.msg.language.spec import FLOATS, INTEGERS, TIMES
from pipros.msg.time import TVal

SMALL = 4
"""After the first message with more fields or elements than this, flat values are written on one line."""


def skeleton(
    message: Message,
    flow_style: bool | None = None,
    excluded: Collection[str] = (),
    *,
    fill_arrays: bool = True,
) -> str:
    """Format the fields of a message as YAML.

    Args:
        message: the message to show.
        flow_style: whether to use brackets; None to use them from the first large message on.
        excluded: names of fields to leave out at every level.
        fill_arrays: whether to show one element in arrays that would be empty.
    """
    fields = _Skeleton(frozenset(excluded), fill_arrays).fields(message)

    class Dumper(_Dumper):
        is_mixed = flow_style is None

    text: str = yaml.dump(fields, Dumper=Dumper, default_flow_style=bool(flow_style))
    return text.rstrip("\n")


class _Fields(dict[str, Any]):
    """The fields of one message, in order."""

    @property
    def is_large(self) -> bool:
        return len(self) > SMALL or any(
            isinstance(part, list) and len(part) > SMALL for part in self.values()
        )


class _Dumper(yaml.SafeDumper):
    """Writes fields in order. After the first large message, flat lists and mappings are on one line."""

    is_mixed = True

    def represent_fields(self, fields: _Fields) -> yaml.Node:
        if self.is_mixed and fields.is_large:
            self.default_flow_style = None  # type: ignore[assignment]  # PyYAML's mixed style
        return self.represent_mapping("tag:yaml.org,2002:map", list(fields.items()))

    def ignore_aliases(self, _data: Any) -> bool:
        return True


_Dumper.add_representer(_Fields, _Dumper.represent_fields)


class _Skeleton:
    def __init__(self, excluded: frozenset[str], fill_arrays: bool) -> None:
        self._excluded = excluded
        self._fill_arrays = fill_arrays

    def fields(self, value: Message | TVal) -> _Fields:
        """Return the fields of a message or a time, including the fields of nested messages."""
        if isinstance(value, TVal):
            named = {"secs": ("int32", value.secs), "nsecs": ("int32", value.nsecs)}
        else:
            kinds = zip(value.__slots__, value._slot_types, strict=True)
            named = {name: (kind, getattr(value, name)) for name, kind in kinds}
        shown = {name: part for name, part in named.items() if name not in self._excluded}
        return _Fields((name, self._plain(kind, part)) for name, (kind, part) in shown.items())

    def _plain(self, kind: str, value: Any) -> Any:
        if isinstance(value, (Message, TVal)):
            return self.fields(value)
        if isinstance(value, (list, tuple)):
            if not value and self._fill_arrays:
                return [self._element(kind.partition("[")[0])]
            return [self._plain(kind.partition("[")[0], element) for element in value]
        return value

    def _element(self, kind: str) -> Any:
        """Return the element to show in an empty array."""
        if kind in INTEGERS or kind in FLOATS:
            return 0
        if kind in ("bool", "string"):
            return False if kind == "bool" else ""
        if kind in TIMES:
            return self.fields(TVal())
        return self.fields(load_message_class(kind)())
