"""Rooms: parts of pipros that can be left out of an installation, and how they extend the other parts.

A room is a package `pipros.<name>` with a module `room.py`, which defines `ROOM`, a `Room`. Other code finds
rooms only through `rooms()`, and never by name. Other distributions can add rooms: each entry point in the
group `pipros.rooms` names a `Room`.

A declaration contains only data. An object that it names as `module:name` is imported when it is used.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from importlib import import_module
from typing import Any, NamedTuple

ENTRY_POINTS = "pipros.rooms"


class RoomCommand(NamedTuple):
    """A program, or a subcommand of `pipros`.

    Attributes:
        target: the function that runs the command, as `module:function`.
        purpose: a one-line description for lists of commands.
        heading: the heading in `pipros --help` under which the command is listed.
        subcommands: the command's subcommands, separated by spaces, for completion.
    """

    target: str
    purpose: str
    heading: str
    subcommands: str = ""


class Room(NamedTuple):
    """The declaration of a room.

    Attributes:
        name: the name of the room's package in `pipros`.
        purpose: the room's purpose, in a few words.
        needs: other rooms that the room imports.
        programs: the programs that the room installs, by name.
        subcommands: the subcommands that it adds to `pipros`, by name.
        verbs: the subcommands that it adds to other programs, by program and name. Their targets take the
            arguments and return the exit code.
        limits: the NamedTuple class of its limits, as `module:name`; empty if it has none.
        check: a `pipros.health.room_check.RoomCheck` for `pipros doctor`, as `module:name`; empty if it has
            none.
        offers: modules and objects that other parts use if the room is installed, by the names that these
            parts pass to `offered`.
        share: its ROS packages in `pipros/share`.
        facades: its packages in `facades`, which have Noetic's names.
        nodelets: the classes of its nodelets, as `module:name`, by plugin name.
        extras: the distribution's extras that it uses, with their requirements.
    """

    name: str
    purpose: str
    needs: tuple[str, ...] = ()
    programs: Mapping[str, RoomCommand] = {}
    subcommands: Mapping[str, RoomCommand] = {}
    verbs: Mapping[str, Mapping[str, RoomCommand]] = {}
    limits: str = ""
    check: str = ""
    offers: Mapping[str, str] = {}
    share: tuple[str, ...] = ()
    facades: tuple[str, ...] = ()
    nodelets: Mapping[str, str] = {}
    extras: Mapping[str, tuple[str, ...]] = {}


def rooms() -> Iterator[Room]:
    """Yield the installed rooms: those in `pipros` by name, then those of other distributions.

    Other distributions are searched only when the iteration reaches them, because this takes longer than most
    commands.
    """
    yield from own_rooms()
    yield from _rooms_of_others()


def verbs(program: str) -> dict[str, RoomCommand]:
    """Return the subcommands that installed rooms add to a program, by name."""
    return {name: each for room in rooms() for name, each in room.verbs.get(program, {}).items()}


def loaded(target: str) -> Any:
    """Import and return a module, or the object named by `module:name`."""
    module, _, name = target.partition(":")
    found = import_module(module)
    return getattr(found, name) if name else found


def offered(name: str) -> Any:
    """Return the object that an installed room offers under a name, or None if no room offers it."""
    target = next((room.offers[name] for room in rooms() if name in room.offers), None)
    return None if target is None else loaded(target)


def all_offered(name: str) -> list[Any]:
    """Return the objects that all installed rooms offer under a name."""
    return all_loaded(lambda room: room.offers.get(name, ""))


def all_loaded(target_of: Callable[[Room], str]) -> list[Any]:
    """Load the targets of all installed rooms that have one.

    A target of another distribution that cannot be loaded is left out, with an error in the log.
    """
    found = []
    for room in rooms():
        target = target_of(room)
        if target and room in own_rooms():
            found.append(loaded(target))
        elif target:
            found += _unless_broken(f"{target} of the room {room.name}", partial(loaded, target))
    return found


def _unless_broken(what: str, load: Callable[[], Any]) -> list[Any]:
    """Return what `load` returns as a list, or an empty list after an error in the log."""
    try:
        return [load()]
    except Exception as error:  # any code of another distribution may run
        _report(f"{what} is left out: {type(error).__name__}: {error}")
        return []


def _report(text: str) -> None:
    import logging  # most commands do not need it

    logging.getLogger("pipros.rooms").error("%s", text)


@cache
def own_rooms() -> tuple[Room, ...]:
    """Return the installed rooms that are part of pipros, sorted by name."""
    folder = os.path.dirname(os.path.dirname(__file__))
    names = sorted(name for name in os.listdir(folder) if os.path.exists(f"{folder}/{name}/room.py"))
    return tuple(loaded(f"pipros.{name}.room:ROOM") for name in names)


@cache
def _rooms_of_others() -> tuple[Room, ...]:
    from importlib.metadata import entry_points

    found: list[Room] = []
    for point in entry_points(group=ENTRY_POINTS):
        where = f"the entry point {point.name} = {point.value} in the group {ENTRY_POINTS}"
        for each in _unless_broken(where, point.load):
            if isinstance(each, Room):
                found.append(each)
            else:
                _report(f"{where} is left out: it must name a Room, got {type(each).__name__}")
    return tuple(found)
