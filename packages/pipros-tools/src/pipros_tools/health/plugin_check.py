"""Checks that rooms add to `pipros doctor`. They judge the reply of a service that the rooms' nodes offer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pipros.basics.rooms import all_loaded
from pipros.health.finding import Findings


@dataclass(frozen=True, slots=True)
class RoomCheck:
    """A check of a room's nodes.

    Attributes:
        prefix: the prefix of these nodes' names. The nodes may subscribe to topics that have no publisher,
            because they subscribe on behalf of clients.
        service: the name of their service, of type std_srvs/Trigger, relative to the node's name.
        judge: function that returns the findings, given a node's name and its reply. Performs no I/O.
    """

    prefix: str
    service: str
    judge: Callable[[str, RoomReply], Findings]


@dataclass(frozen=True, slots=True)
class RoomReply:
    """The reply of a room's node to a check.

    Attributes:
        success, message: the fields of the response.
        failure: why the node did not respond; empty if it did.
    """

    check: RoomCheck
    success: bool = False
    message: str = ""
    failure: str = ""


def room_checks() -> list[RoomCheck]:
    """Return the checks of all installed rooms."""
    return all_loaded(lambda room: room.check)
