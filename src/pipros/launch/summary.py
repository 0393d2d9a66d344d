"""The lists of parameters and nodes that roslaunch prints before it starts them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pipros.launch.model import Node

_VALUE_CHARACTERS = 20


def summary(
    params: Mapping[str, Any],
    nodes: Iterable[Node],
    *,
    machines: Iterable[str] = (),
    is_core: bool = False,
) -> str:
    """The summary as Noetic prints it. A core lists no nodes below its NODES."""
    lines = ["", "SUMMARY", "========", ""]
    if is_core:
        lines.insert(0, "")
    if params:
        lines += ["PARAMETERS", *(f" * {key}: {_short(params[key])}" for key in sorted(params)), ""]
    if names := sorted(machines):
        lines += ["MACHINES", *(f" * {name}" for name in names), ""]
    lines += ["NODES"]
    below: dict[str, list[str]] = {}
    for node in nodes:
        below.setdefault(node.namespace, []).append(f"    {node.name} ({node.package}/{node.type})")
    for namespace in sorted(below):
        lines += [f"  {namespace}", *sorted(below[namespace])]
    return "\n".join([*lines, ""])


def _short(value: Any) -> str:
    """One line of a value, cut after 20 characters; what has other than plain characters is left out."""
    text = (value.decode("latin-1") if isinstance(value, bytes) else str(value)).strip()
    if len(text) > _VALUE_CHARACTERS:
        text = text[: _VALUE_CHARACTERS - 3] + "..."
    return text if text.isascii() and text.isprintable() else "<...>"
