"""Rooms: parts of pipros that can be left out of an installation, and what they add to the rest.

A room is a package `pipros.ROOM` with a module `room.py`, which defines `ROOM`, a `Room`. Everything else
finds rooms only through `rooms()`, and names none. Other distributions can add rooms: each entry point of the
group `pipros.rooms` names a `Room`.

A declaration contains only data. What it names as `module:name` is imported when it is used.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

ENTRY_POINTS = "pipros.rooms"


class RoomCommand(NamedTuple):
    """A program, or a subcommand of `pipros`.

    Attributes:
        target: the function that runs it, as `module:function`.
        purpose: one line for lists of commands.
        heading: the heading above this line in `pipros --help`.
        subcommands: its subcommands, separated by blanks, for completion.
    """

    target: str
    purpose: str
    heading: str
    subcommands: str = ""


class Room(NamedTuple):
    """The declaration of a room.

    Attributes:
        name: the name of its package in `pipros`.
        purpose: what it is for, in a few words.
        needs: other rooms that it imports.
        programs: the programs that it installs, by name.
        subcommands: its subcommands of `pipros`, by name.
        verbs: its subcommands of other programs, by name, for each program. Their targets take the arguments
            and return the exit code.
        limits: a NamedTuple of its limits, with defaults; empty if it has none.
        check: a `pipros.health.room_check.RoomCheck` for `pipros doctor`; empty if it has none.
        offers: what it does for other parts, by the name under which they look for it; see `offered`.
        share: its ROS packages in `pipros/share`.
        facades: its packages with Noetic's names in `facades`.
        extras: the extras of the distribution that it uses, with their requirements.
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
    extras: Mapping[str, tuple[str, ...]] = {}


def rooms() -> Iterator[Room]:
    """Yield the installed rooms: those in `pipros` by name, then those of other distributions.

    The latter are only looked for when they are reached, because the search takes longer than most commands.
    """
    yield from own_rooms()
    yield from _rooms_of_others()


def verbs(program: str) -> dict[str, RoomCommand]:
    """Return the subcommands that installed rooms add to a program, by name."""
    return {name: each for room in rooms() for name, each in room.verbs.get(program, {}).items()}


def loaded(target: str) -> Any:
    """Import and return a module, or what `module:name` names."""
    module, _, name = target.partition(":")
    found = import_module(module)
    return getattr(found, name) if name else found


def offered(name: str) -> Any:
    """Return what an installed room offers under a name, or None if no room offers it."""
    target = next((room.offers[name] for room in rooms() if name in room.offers), None)
    return None if target is None else loaded(target)


def all_offered(name: str) -> list[Any]:
    """Return what the installed rooms offer under a name."""
    return [loaded(room.offers[name]) for room in rooms() if name in room.offers]


@cache
def own_rooms() -> tuple[Room, ...]:
    """Return the installed rooms of pipros, by name."""
    folder = os.path.dirname(os.path.dirname(__file__))
    names = sorted(name for name in os.listdir(folder) if os.path.exists(f"{folder}/{name}/room.py"))
    return tuple(loaded(f"pipros.{name}.room:ROOM") for name in names)


@cache
def _rooms_of_others() -> tuple[Room, ...]:
    from importlib.metadata import entry_points

    return tuple(point.load() for point in entry_points(group=ENTRY_POINTS))
