"""Completion candidates for a word: packages, programs, files, types, and names in the running system."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pipros.basics.input_file import read_file
from pipros_tools.cli.complete.options import options, words_after
from pipros_tools.cli.complete.running import live_names, prototype, service_type

if TYPE_CHECKING:
    from pipros_workspace.index import PackageIndex

_ENDINGS = {"roslaunch": (".launch", ".test"), "rostest": (".test", ".launch")}
_KINDS = {"rosmsg": "msg", "rossrv": "srv", "rosaction": "action"}
_TARGETS = ("install", "run_tests", "tests", "clean")

_FILES_LIMIT = 2000


def candidates(words: Sequence[str]) -> Iterable[str]:
    """Return the candidates for the last word."""
    command, *before, current = words
    command = os.path.basename(command)
    if current.startswith("-"):
        return options(command, before)
    before = [word for word in before if not word.startswith("-")]
    words = words_after(command)
    if words:
        return _for_subcommand(command, before, current) if before else words
    if command in ("roscd", "rosls", "rospd"):
        return [] if before else _folders(current)
    if command == "catkin_make":
        return _TARGETS
    if command == "rosrun":
        return _programs(before[0]) if len(before) == 1 else [] if before else _packages_with_programs()
    if not before:
        return _packages()
    package = _index().get(before[0])
    if package is None:
        return []
    if command in _ENDINGS and len(before) == 2:
        return _arguments(str(package.path), before[1])
    return _files(str(package.path), _ENDINGS.get(command, ("",))) if len(before) == 1 else []


def _for_subcommand(command: str, before: Sequence[str], current: str) -> Iterable[str]:
    if command in ("rospack", "rosstack"):
        return _packages()
    if command == "pipros":
        return _packages() if before[0] == "stubs" else _words_of(before) if len(before) == 1 else []
    if command in _KINDS:
        if before[0] == "package":
            return _packages()
        return [] if before[0] in ("list", "packages") else _types(_KINDS[command], current)
    if command == "rostopic" and before[0] == "pub" and len(before) == 2:
        return _types("msg", current)
    if command == "rostopic" and before[0] == "pub" and len(before) == 3:
        return [] if current else prototype("msg", before[2])
    if command == "rosservice" and before[0] == "call" and len(before) == 2:
        return [] if current else prototype("srv", service_type(before[1]))
    return live_names(command, before)


def _words_of(before: Sequence[str]) -> list[str]:
    from pipros_tools.cli.subcommands import subcommands

    found = subcommands().get(before[0])
    return [] if found is None else found.subcommands.split()


def _index() -> PackageIndex:
    # imported only here, because completing names in the running system does not need it
    from pipros_workspace.index import PackageIndex

    return PackageIndex.from_environment()


def _packages() -> list[str]:
    return [package.name for package in _index()]


def _packages_with_programs() -> list[str]:
    from pipros.packages.system_packages import names_without_manifest

    return sorted({*_packages(), *names_without_manifest()})


def _programs(package: str) -> list[str]:
    from pipros.basics.errors import NotFound
    from pipros_workspace.executables import list_executables, package_of_programs

    try:
        return list_executables(package_of_programs(_index(), package))
    except NotFound:
        return []


def _folders(current: str) -> list[str]:
    """Return packages and `log/`, or the folders inside a package, such as `package/folder/`."""
    index = _index()
    name, slash, rest = current.partition("/")
    package = index.get(name) if slash else None
    if package is None:
        return [*(f"{known.name}/" for known in index), "log/"]
    below = os.path.dirname(rest)
    try:
        entries = sorted(os.scandir(os.path.join(package.path, below)), key=lambda entry: entry.name)
    except OSError:
        return []
    shown = [entry.name for entry in entries if entry.is_dir() and not entry.name.startswith(".")]
    return ["/".join(filter(None, (name, below, folder))) + "/" for folder in shown]


def _files(folder: str, endings: tuple[str, ...]) -> list[str]:
    found: set[str] = set()
    for _, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found.update(name for name in files if name.endswith(endings))
        if len(found) > _FILES_LIMIT:
            break
    return sorted(found)


def _arguments(folder: str, name: str) -> list[str]:
    """Return a launch file's settable arguments, in the form `name:=`."""
    from pipros.safe.xml import XmlError, parse

    for base, folders, files in os.walk(folder):
        folders[:] = [sub for sub in folders if not sub.startswith(".")]
        if name in files:
            path = os.path.join(base, name)
            try:
                root = parse(read_file(path), path)
            except (XmlError, OSError):
                return []
            settable = [
                argument.attributes for argument in root.all("arg") if "value" not in argument.attributes
            ]
            return [f"{attributes['name']}:=" for attributes in settable if "name" in attributes]
    return []


def _types(kind: str, current: str) -> list[str]:
    """Return the packages that contain definitions of this kind, each followed by a slash, as in `std_msgs/`.

    If `current` already contains a package and a slash, return the types in that package.
    """
    from pipros.msg.importing.hook import installed_library

    package, slash, _ = current.partition("/")
    if not slash:
        return [f"{known.name}/" for known in _index() if (known.path / kind).is_dir()]
    return [f"{package}/{name}" for name in installed_library().files.names(kind, package)]
