"""`pipros port`: lists what becomes what when a rospy node moves to rclpy, and writes a draft."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.printable import listed
from pipros.basics.replaced_file import write_whole
from pipros.msg.language.full_text import DEFINITION_BYTES
from pipros_tools.cli.runner import CommandError, option_parser, run

if TYPE_CHECKING:
    from pipros_ros2.port.launches import LaunchDrafts


def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _port(list(sys.argv[1:] if argv is None else argv)))


def _port(argv: list[str]) -> int:
    parser = option_parser(
        "pipros port", "[--write DIR] FILE|PACKAGE", "Lists what changes from rospy to rclpy."
    )
    parser.add_option(
        "--write", metavar="DIR", help="write drafts to the folder DIR, which must not contain them"
    )
    options, words = parser.parse_args(argv)
    if len(words) != 1:
        parser.error("give one file, package or package folder")
    source = _source(words[0])
    target = None if options.write is None else Path(options.write)
    launches, left_out = None, 0
    try:
        launches = _launches(source)
        left_out = len(launches.left_out) if launches else 0
    except PiprosError as error:  # the nodes are drafted without it
        print(f"package.xml: left out: {listed(str(error))}", file=sys.stderr)
        left_out = 1
    scripts = []
    if not (files := list(_files(source))) and not launches:
        raise CommandError(f"{listed(str(source))} has no Python files")
    for file in files:
        name = str(file.relative_to(source)) if source.is_dir() else file.name
        values = launches.values(file.name) if launches else {}
        failed, is_node = _port_file(file, name, target, values)
        left_out += failed
        scripts += [name] if is_node and not name.startswith("test") else []
    if launches:
        left_out += _port_package(source, launches, scripts, target)
    return 1 if left_out else 0


def _launches(source: Path) -> LaunchDrafts | None:
    """Return the drafts of a package's launch files, or None for other sources."""
    from pipros_ros2.port.launches import LaunchDrafts
    from pipros_workspace.manifest import read_manifest

    if not (source / "package.xml").is_file():
        return None
    try:
        return LaunchDrafts(source, read_manifest(source).name)
    except OSError as error:
        raise CommandError(f"cannot read it: {error.strerror}") from None


def _port_package(source: Path, launches: LaunchDrafts, scripts: Sequence[str], target: Path | None) -> int:
    """List the changes of a package's other files, and write their drafts.

    Return 1 if package.xml cannot be drafted, otherwise 0.
    """
    from pipros_ros2.port.package import package_files

    files, failed = dict(launches.files), 0
    if target is not None and (target / "package.xml").exists():
        print(f"package.xml: left out: {listed(str(target))} has its own")
    else:
        try:
            files.update(package_files(source, scripts, list(launches.files)))
        except PiprosError as error:
            print(f"package.xml: left out: {listed(str(error))}", file=sys.stderr)
            failed = 1
    for name, reason in launches.left_out.items():
        print(f"{listed(name)}: left out: {listed(reason)}", file=sys.stderr)
    for name, text in files.items():
        todos = [
            line.partition("TODO: ")[2].removesuffix(" -->") for line in text.splitlines() if "TODO: " in line
        ]
        for todo in todos:
            print(f"{listed(name)}: TODO: {listed(todo)}")
        print(f"{listed(name)}: draft, {len(todos)} TODO")
        if target is not None:
            _write(target / name, text, 0o644)
    return failed


def _source(word: str) -> Path:
    """Return a file or folder, or the folder of a package."""
    from pipros_rosbag2.interfaces.installed import installed_package

    if Path(word).exists():
        return Path(word)
    folder = None if "/" in word else installed_package(word)
    if folder is None:
        raise CommandError(f"{listed(word)} is neither a file, a folder nor a package")
    return folder


def _files(source: Path) -> Iterator[Path]:
    """Yield the Python files of a package, including scripts without a suffix."""
    if not source.is_dir():
        yield source
        return
    for file in sorted(source.rglob("*")):
        if file.suffix == ".py" and file.name != "setup.py" and file.is_file():
            yield file
        elif not file.suffix and file.is_file():
            with open_file(file) as opened:
                first = opened.readline(200)
            if first.startswith(b"#!") and b"python" in first:
                yield file


def _port_file(file: Path, name: str, target: Path | None, values: Mapping[str, Any]) -> tuple[int, bool]:
    """List the changes of a file, and write its draft.

    Return 1 if the file cannot be read, otherwise 0; and whether it is a program.
    """
    from pipros.basics.input_file import read_text
    from pipros_ros2.port.draft import NotPortable, draft_of
    from pipros_rosbag2.interfaces.installed import installed_definitions

    try:
        text = read_text(str(file), DEFINITION_BYTES)
        draft = draft_of(text, installed_definitions(), name, values)
    except (OSError, UnicodeDecodeError, NotPortable) as error:
        print(f"{listed(name)}: left out: {listed(str(error))}", file=sys.stderr)
        return 1, False
    for change in draft.changes:
        old = listed(" ".join(change.old.split()))
        what = f"TODO: {change.reason}" if change.reason else f"-> {' '.join(change.new.split())}"
        print(f"{listed(name)}:{change.line}: {old} {listed(what)}")
    todos = sum(1 for each in draft.changes if each.reason)
    if draft.changes:
        print(f"{listed(name)}: {len(draft.changes) - todos} changes, {todos} TODO")
    if target is not None:
        _write(target / name, draft.text, file.stat().st_mode & 0o777)
    return 0, text.startswith("#!")


def _write(path: Path, text: str, mode: int) -> None:
    try:
        if os.path.lexists(path):
            raise CommandError(f"{listed(str(path))} exists already; give another folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
        path.chmod(mode)
    except OSError as error:
        raise CommandError(f"cannot write {listed(str(path))}: {error.strerror}") from None
