"""`pipros port`: lists what becomes what when a rospy node moves to rclpy, and writes a draft."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from pipros.basics.printable import listed
from pipros.cli.runner import CommandError, option_parser, run

_PACKAGE_FILES = {
    "package.xml": "catkin becomes ament_python or ament_cmake, and rospy rclpy",
    "CMakeLists.txt": "a package with Python nodes alone needs setup.py instead, in the form of ament_python",
    "setup.py": "list the nodes in scripts or entry_points, and resource/PACKAGE in data_files",
}
_LAUNCH = "launch files of ROS 2 have other elements; --ros-args -p name:=value sets parameters"


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
    base = source if source.is_dir() else source.parent
    left_out = 0
    for file in _files(source):
        left_out += _port_file(file, base, None if options.write is None else Path(options.write))
    if source.is_dir():
        for name, what in _PACKAGE_FILES.items():
            if (source / name).is_file():
                print(f"{name}: TODO: {what}")
        for launch in sorted(source.rglob("*.launch")):
            print(f"{listed(str(launch.relative_to(source)))}: TODO: {_LAUNCH}")
    return 1 if left_out else 0


def _source(word: str) -> Path:
    """Return a file or folder, or the folder of a package."""
    from pipros.ros2.interfaces.catalog import installed_package

    if Path(word).exists():
        return Path(word)
    folder = None if "/" in word else installed_package(word)
    if folder is None:
        raise CommandError(f"{listed(word)} is neither a file, a folder nor a package")
    return folder


def _files(source: Path) -> Iterator[Path]:
    """Yield the Python files of a package, including scripts without a suffix."""
    if source.is_file():
        yield source
        return
    for file in sorted(source.rglob("*")):
        if file.suffix == ".py" and file.name != "setup.py" and file.is_file():
            yield file
        elif not file.suffix and file.is_file():
            with file.open("rb") as opened:
                first = opened.readline(200)
            if first.startswith(b"#!") and b"python" in first:
                yield file


def _port_file(file: Path, base: Path, target: Path | None) -> int:
    """List the changes of a file, and write its draft. Return 1 if the file cannot be read, otherwise 0."""
    from pipros.basics.input_file import read_text
    from pipros.basics.limits import process_limits
    from pipros.ros2.interfaces.catalog import installed_definitions
    from pipros.ros2.port.draft import NotPortable, draft_of

    name = str(file.relative_to(base))
    try:
        text = read_text(str(file), process_limits().definition_bytes)
        draft = draft_of(text, installed_definitions(), name)
    except (OSError, UnicodeDecodeError, NotPortable, RecursionError) as error:
        print(f"{listed(name)}: left out: {listed(str(error))}", file=sys.stderr)
        return 1
    for change in draft.changes:
        old = listed(" ".join(change.old.split()))
        what = f"TODO: {change.reason}" if change.reason else f"-> {' '.join(change.new.split())}"
        print(f"{listed(name)}:{change.line}: {old} {listed(what)}")
    todos = sum(1 for each in draft.changes if each.reason)
    if draft.changes:
        print(f"{listed(name)}: {len(draft.changes) - todos} changes, {todos} TODO")
    if target is not None:
        _write(target / name, draft.text, file)
    return 0


def _write(path: Path, text: str, source: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as opened:
            opened.write(text)
        path.chmod(source.stat().st_mode & 0o777)
    except FileExistsError:
        raise CommandError(f"{listed(str(path))} exists already; give another folder") from None
    except OSError as error:
        raise CommandError(f"cannot write {listed(str(path))}: {error.strerror}") from None
