"""Determine which rooms a build contains, for hatchling's hooks.

`PIPROS_ROOMS` names them, separated by commas; it may be empty. Without it, a build contains all rooms.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pipros.basics.rooms import Room

VARIABLE = "PIPROS_ROOMS"


class BadRooms(ValueError):
    """`PIPROS_ROOMS` has an unknown name, or lacks a room that another one needs."""


class Rooms(NamedTuple):
    """The rooms of a source tree.

    Attributes:
        built: those in the build.
        left_out: all others.
    """

    built: list[Room]
    left_out: list[Room]

    def excluded(self) -> list[str]:
        """Return the paths that are left out, relative to the folders on `sys.path`."""
        return [
            path
            for room in self.left_out
            for path in (
                f"pipros/{room.name}",
                *(f"pipros/share/{name}" for name in room.share),
                *room.facades,
            )
        ]

    def scripts(self) -> dict[str, str]:
        """Return the programs of all rooms. Those that are left out say so when they are started."""
        found = {name: each.target for room in self.built for name, each in room.programs.items()}
        return found | {name: "pipros.cli.absent:main" for room in self.left_out for name in room.programs}

    def absent_commands(self) -> dict[str, tuple[str, str]]:
        """Return the room and its purpose for each command that is left out."""
        return {
            name: (room.name, room.purpose)
            for room in self.left_out
            for name in (
                *room.programs,
                *(f"pipros {each}" for each in room.subcommands),
                *(f"{program} {each}" for program, verbs in room.verbs.items() for each in verbs),
            )
        }

    def extras(self) -> dict[str, list[str]]:
        """Return the extras of the rooms in the build."""
        return {name: list(needed) for room in self.built for name, needed in room.extras.items()}


def rooms_of(root: Path, chosen: str | None = None) -> Rooms:
    """Return the rooms of a source tree. `chosen` is the value of `PIPROS_ROOMS`; None for all.

    Raises:
        BadRooms: a name is unknown, or a chosen room needs one that is not chosen.
    """
    source = str(root / "build" / "src")
    if source not in sys.path:
        sys.path.insert(0, source)
    from pipros.basics.rooms import own_rooms

    rooms = {room.name: room for room in own_rooms()}
    names = list(rooms) if chosen is None else [name for name in map(str.strip, chosen.split(",")) if name]
    for name in names:
        if name not in rooms:
            raise BadRooms(f"{VARIABLE}: unknown room [{name}]; the rooms are {', '.join(rooms)}")
        for needed in rooms[name].needs:
            if needed not in names:
                raise BadRooms(f"{VARIABLE}: the room {name} needs the room {needed}; add it")
    return Rooms(
        [room for room in rooms.values() if room.name in names],
        [room for room in rooms.values() if room.name not in names],
    )


def repository_of(root: Path) -> Path:
    """Return the repository of a build's folder, which is the repository or one of its packages."""
    return root if (root / "packages").is_dir() else root.parents[1]


def rooms_of_build(root: str) -> Rooms:
    """Return the rooms that `PIPROS_ROOMS` selects for the current build, or the rooms of one package."""
    folder = Path(root)
    repository = repository_of(folder)
    import_from_source(repository)
    if repository == folder:
        return rooms_of(folder, os.environ.get(VARIABLE))
    built = [room for room in rooms_of(repository).built if has_room(folder, room.name)]
    return Rooms(built, [])


def has_room(package: Path, name: str) -> bool:
    """Return whether a room belongs to a package, which is a folder of `packages`."""
    return (package / "src" / "pipros" / name / "room.py").is_file()


def packages_needed(package: Path, rooms: Rooms) -> list[str]:
    """Return the other packages that a package imports: the core, and those of the rooms that its rooms need.

    The core's facades use some of `pipros-internals`, which use the core.
    """
    if package.name == "pipros":
        return ["pipros-internals"]
    others = [each for each in sorted(package.parent.iterdir()) if each != package]
    needed = {name for room in rooms.built for name in room.needs}
    return ["pipros", *(each.name for each in others if any(has_room(each, name) for name in needed))]


def import_from_source(root: Path) -> None:
    """Make the build import `pipros` from the source tree, not from an installed version.

    If pip upgrades pipros in a virtual environment, the `pipros.pth` of the installed version has already
    imported its modules, and added its finders, before pip isolates the build.
    """
    from merge_packages import merge

    merge(root.resolve())
    source = root.resolve() / "build" / "src"
    sys.path[:] = [str(source), *(entry for entry in sys.path if entry != str(source))]
    imported = sys.modules.get("pipros")
    if imported is None or source / "pipros" in [Path(folder).resolve() for folder in imported.__path__]:
        return
    for name in [name for name in sys.modules if name.partition(".")[0] == "pipros"]:
        del sys.modules[name]
    sys.meta_path[:] = [each for each in sys.meta_path if not type(each).__module__.startswith("pipros.")]
