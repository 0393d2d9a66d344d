"""What rooms add to `pipros doctor`: a service of their nodes, and how its reply is judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pipros.basics.rooms import loaded, rooms
from pipros.health.finding import Findings


@dataclass(frozen=True, slots=True)
class RoomCheck:
    """The check of a room's nodes.

    Attributes:
        prefix: what the names of these nodes start with. The nodes may subscribe to topics that have no
            publisher, because they subscribe for others.
        service: the name of their service, of type std_srvs/Trigger, relative to the node's name.
        judge: returns the findings for a node's name and its reply. Performs no I/O.
    """

    prefix: str
    service: str
    judge: Callable[[str, RoomReply], Findings]


@dataclass(frozen=True, slots=True)
class RoomReply:
    """The reply of a room's node.

    Attributes:
        success, message: the fields of the response.
        failure: why there is no response; empty if there is one.
    """

    check: RoomCheck
    success: bool = False
    message: str = ""
    failure: str = ""


def room_checks() -> list[RoomCheck]:
    """Return the checks of all installed rooms."""
    return [loaded(room.check) for room in rooms() if room.check]
