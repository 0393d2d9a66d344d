"""Checks that plugins add to `pipros doctor`. They judge the reply of a service of the plugins' nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pipros.basics.plugins import all_loaded
from pipros_tools.health.finding import Findings


@dataclass(frozen=True, slots=True)
class PluginCheck:
    """A check of a plugin's nodes.

    Attributes:
        prefix: the prefix of these nodes' names. The nodes may subscribe to topics that have no publisher,
            because they subscribe on behalf of clients.
        service: the name of their service, of type std_srvs/Trigger, relative to the node's name.
        judge: function that returns the findings, given a node's name and its reply. Performs no I/O.
    """

    prefix: str
    service: str
    judge: Callable[[str, PluginReply], Findings]


@dataclass(frozen=True, slots=True)
class PluginReply:
    """The reply of a plugin's node to a check.

    Attributes:
        success, message: the fields of the response.
        failure: why the node did not respond; empty if it did.
    """

    check: PluginCheck
    success: bool = False
    message: str = ""
    failure: str = ""


def plugin_checks() -> list[PluginCheck]:
    """Return the checks of all installed plugins."""
    return all_loaded(lambda plugin: plugin.check)
