"""`pipros-complete`: what a shell may offer for the word at the cursor of a ROS command.

Called by the shells' completion with the position of the word and all words; prints one candidate a line.
A candidate of several lines comes alone, behind the character 0x1f.
With `--find PACKAGE NAME` it prints the files of that name in a package, for roscat, rosed and roscp.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence

from pipros.cli.complete_options import SUBCOMMANDS, options
from pipros.cli.complete_running import live_names, prototype, service_type
from pipros.workspace.executables import list_executables
from pipros.workspace.index import PackageIndex

_ENDINGS = {"roslaunch": (".launch", ".test"), "rostest": (".test", ".launch")}
_KINDS = {"rosmsg": "msg", "rossrv": "srv", "rosaction": "action"}
_TARGETS = ("install", "run_tests", "tests", "clean")

_FILES_LIMIT = 2000


def main(argv: Sequence[str] | None = None) -> int:
    """Prints the candidates; prints nothing when it knows none."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == ["--find"] and len(arguments) == 3:
        return _print_files(*arguments[1:])
    if len(arguments) < 2 or not arguments[0].isdecimal():
        print("usage: pipros-complete POSITION WORD...", file=sys.stderr)
        return 2
    position, words = int(arguments[0]), arguments[1:]
    words += [""] * (position + 1 - len(words))
    started = words[position]
    for candidate in candidates(words[: position + 1], PackageIndex.from_environment()):
        if candidate.startswith(started):
            print(candidate)
    return 0


def _print_files(package_name: str, name: str) -> int:
    package = PackageIndex.from_environment().get(package_name)
    if package is None:
        print(f"[rospack] Error: package '{package_name}' not found", file=sys.stderr)
        return 1
    if (package.path / name).is_file():
        print(package.path / name)
        return 0
    for folder, folders, files in os.walk(package.path):
        folders[:] = sorted(sub for sub in folders if not sub.startswith("."))
        if name in files:
            print(os.path.join(folder, name))
    return 0


def candidates(words: Sequence[str], index: PackageIndex) -> Iterable[str]:
    """What may stand for the last of the words."""
    command, *before, current = words
    command = os.path.basename(command)
    if current.startswith("-"):
        return options(command, before)
    before = [word for word in before if not word.startswith("-")]
    if command in SUBCOMMANDS:
        if not before:
            return SUBCOMMANDS[command].split()
        return _of_subcommand(command, before, current, index)
    if command in ("roscd", "rosls", "rospd"):
        return [] if before else _places(index, current)
    if command == "catkin_make":
        return _TARGETS
    if not before:
        return _packages(index)
    package = index.get(before[0])
    if package is None:
        return []
    if command == "rosrun":
        return list_executables(package) if len(before) == 1 else []
    if command in _ENDINGS and len(before) == 2:
        return _arguments(str(package.path), before[1])
    return _files(str(package.path), _ENDINGS.get(command, ("",))) if len(before) == 1 else []


def _of_subcommand(command: str, before: Sequence[str], current: str, index: PackageIndex) -> Iterable[str]:
    if command == "rospack":
        return _packages(index)
    if command in _KINDS:
        if before[0] == "package":
            return _packages(index)
        return [] if before[0] in ("list", "packages") else _types(_KINDS[command], current, index)
    if command == "rostopic" and before[0] == "pub" and len(before) == 2:
        return _types("msg", current, index)
    if command == "rostopic" and before[0] == "pub" and len(before) == 3:
        return [] if current else prototype("msg", before[2])
    if command == "rosservice" and before[0] == "call" and len(before) == 2:
        return [] if current else prototype("srv", service_type(before[1]))
    return live_names(command, before)


def _packages(index: PackageIndex) -> list[str]:
    return [package.name for package in index]


def _places(index: PackageIndex, current: str) -> list[str]:
    """Packages, or folders below one: `package/folder/`."""
    name, slash, rest = current.partition("/")
    package = index.get(name) if slash else None
    if package is None:
        return [f"{known.name}/" for known in index]
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
    """The arguments of a launch file that may be set: `name:=`."""
    from pipros.safe.xml import XmlError, parse

    for base, folders, files in os.walk(folder):
        folders[:] = [one for one in folders if not one.startswith(".")]
        if name in files:
            path = os.path.join(base, name)
            try:
                with open(path, "rb") as file:
                    root = parse(file.read(), path)
            except (XmlError, OSError):
                return []
            settable = [one.attributes for one in root.all("arg") if "value" not in one.attributes]
            return [f"{attributes['name']}:=" for attributes in settable if "name" in attributes]
    return []


def _types(kind: str, current: str, index: PackageIndex) -> list[str]:
    """Packages with such definitions, `std_msgs/`, or, below one, its types."""
    from pipros.msg.hook import installed_library

    package, slash, _ = current.partition("/")
    if not slash:
        return [f"{known.name}/" for known in index if (known.path / kind).is_dir()]
    return [f"{package}/{name}" for name in installed_library().files.names(kind, package)]


if __name__ == "__main__":
    sys.exit(main())
