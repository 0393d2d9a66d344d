"""Message classes made at run time from a full text: of a connection header, of a bag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.msg.base import Message
from pipros.msg.compiler import message_source
from pipros.msg.digest import SEPARATOR
from pipros.msg.parse import parse_message
from pipros.msg.pickling import make_picklable
from pipros.msg.spec import HEADER, DefinitionError, MessageSpec

TEXT_LIMIT_BYTES = 4 * 1024 * 1024
TYPES_LIMIT = 1000
"""Limits for a text that a stranger sends: real ones stay below 100 kB and 100 types."""

_OLD_HEADER = "roslib/Header"  # what bags from the time before std_msgs/Header call it


def specs_from_text(type_name: str, full_text: str) -> dict[str, MessageSpec]:
    """The definitions in a full text by type name; the one of `type_name` comes first.

    Raises:
        DefinitionError: for a broken definition, or a text with too much in it.
    """
    where = f"<definition of {type_name}>"
    if len(full_text) > TEXT_LIMIT_BYTES:
        raise DefinitionError(f"the text is longer than {TEXT_LIMIT_BYTES} characters", file=where)
    full_text = full_text.replace("\r\n", "\n")  # as reading a file does
    parts: dict[str, list[str]] = {}
    current = parts[type_name] = []
    expects_name = False
    for line in full_text.split("\n"):
        if expects_name:
            if not line.startswith("MSG: "):
                raise DefinitionError("expected MSG: package/Name behind a separator", file=where)
            name = line.removeprefix("MSG: ").strip()
            current = parts[HEADER if name == _OLD_HEADER else name] = []
            expects_name = False
        elif line.startswith(SEPARATOR):
            expects_name = True
        else:
            current.append(line)
    if len(parts) > TYPES_LIMIT:
        raise DefinitionError(f"the text has more than {TYPES_LIMIT} types", file=where)
    return {name: parse_message("\n".join(lines), name) for name, lines in parts.items()}


def message_classes_from_text(type_name: str, full_text: str) -> dict[str, type[Message]]:
    """Classes for all types in a full text, independent of any package.

    Raises:
        DefinitionError: for a broken definition, an embedded type that the text lacks, or a text
            with too much in it.
    """
    specs = specs_from_text(type_name, full_text)
    classes: dict[str, type[Message]] = {}

    def make(name: str) -> type[Message]:
        if name not in classes:
            source, embedded = message_source(specs[name], specs.__getitem__)
            namespace = {alias: make(inner) for inner, alias in embedded.items()}
            made = _execute(source, f"<message {name}>", namespace)[specs[name].name]
            made.__name__ = made.__qualname__ = f"_{name.replace('/', '__')}"  # as genpy names it
            classes[name] = make_picklable(made)
        return classes[name]

    return {name: make(name) for name in specs}


def _execute(source: str, file: str, namespace: Mapping[str, Any]) -> dict[str, Any]:
    """Runs source made by `compiler.py` and gives its names."""
    names: dict[str, Any] = {"__name__": __name__, **namespace}
    exec(compile(source, file, "exec"), names)  # noqa: S102 # made by our compiler from checked names
    return names
