"""`genmsg.command_line`: arguments of message code generators."""

from __future__ import annotations

from collections.abc import Iterable


def includepath_to_dict(includepath: Iterable[str]) -> dict[str, list[str]]:
    """Convert arguments of the form `package:folder` to a search path, `{package: [folders]}`."""
    found: dict[str, list[str]] = {}
    for argument in includepath:
        package, sign, folder = argument.partition(":")
        found.setdefault(package if sign else "", []).append(folder if sign else argument)
    return found
