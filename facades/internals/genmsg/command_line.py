"""`genmsg.command_line`: the arguments of generators of message code."""

from __future__ import annotations

from collections.abc import Iterable


def includepath_to_dict(includepath: Iterable[str]) -> dict[str, list[str]]:
    """The search path, `{package: [folders]}`, that arguments `package:folder` mean."""
    found: dict[str, list[str]] = {}
    for argument in includepath:
        package, sign, folder = argument.partition(":")
        found.setdefault(package if sign else "", []).append(folder if sign else argument)
    return found
