"""`pipros-complete`: what a shell may offer for the word at the cursor of a ROS command.

Called by the shells' completion with the position of the word and all words; prints one candidate a line.
With `--find PACKAGE NAME` it prints the files of that name in a package, for roscat, rosed and roscp.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence

from pipros.workspace.executables import list_executables
from pipros.workspace.index import PackageIndex

_SUBCOMMANDS = {
    "rostopic": "bw delay echo find hz info list pub type",
    "rosnode": "cleanup info kill list machine ping",
    "rosparam": "delete dump get list load set",
    "rosservice": "args call find info list type uri",
    "rosmsg": "info list md5 package packages show",
    "rossrv": "info list md5 package packages show",
    "rospack": "depends depends-indent depends-on depends-on1 depends-why depends1 find list list-duplicates "
    "list-names plugins profile rosdep rosdep0",
}

_ENDINGS = {"roslaunch": (".launch", ".test", ".xml"), "rostest": (".test", ".launch")}

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
    if command in _SUBCOMMANDS:
        if not before:
            return _SUBCOMMANDS[command].split()
        return _packages(index) if command == "rospack" else _live(command, before)
    before = [word for word in before if not word.startswith("-")]
    if command in ("roscd", "rosls", "rospd"):
        return _places(index, current)
    if not before:
        return _packages(index)
    package = index.get(before[0])
    if package is None or len(before) > 1:
        return []
    if command == "rosrun":
        return list_executables(package)
    return _files(str(package.path), _ENDINGS.get(command, ("",)))


def _packages(index: PackageIndex) -> list[str]:
    return [package.name for package in index]


def _places(index: PackageIndex, current: str) -> list[str]:
    """Packages, or folders below one: `package/folder/`."""
    name, slash, rest = current.partition("/")
    package = index.get(name) if slash else None
    if package is None:
        return [f"{known.name}" for known in index]
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


def _live(command: str, before: Sequence[str]) -> list[str]:
    """Names from the running system; none when no master answers at once."""
    from pipros.env import Environment
    from pipros.errors import PiprosError
    from pipros.net.master import MasterClient

    client = MasterClient(Environment.from_os().master_uri, "/complete", timeout_s=0.5)
    try:
        if command == "rosparam":
            return client.get_param_names()
        if command == "rostopic" and len(before) == 1:
            return sorted(name for name, _ in client.get_topic_types())
        publishers, subscribers, services = client.get_system_state()
        if command == "rosservice":
            return sorted(name for name, _ in services)
        if command == "rosnode":
            return sorted(
                {node for part in (publishers, subscribers, services) for _, ns in part for node in ns}
            )
    except PiprosError:
        pass
    finally:
        client.close()
    return []


if __name__ == "__main__":
    sys.exit(main())
