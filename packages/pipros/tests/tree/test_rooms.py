"""Rooms can be taken out: no other file names one, and builds without them are complete."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.basics.rooms import loaded, own_rooms
from tests.support.absent_rooms import DELETED_ROOMS, PACKAGES
from tests.support.environments import FACADES, REPOSITORY, SRC, files_below, import_path
from tests.support.project import PROJECT
from tests.tree.test_packaging import build_wheel

sys.path.insert(0, str(REPOSITORY / "script"))
import build_rooms

ROOMS = {room.name: room for room in own_rooms()}


def folder_of_rooms() -> dict[str, str]:
    """Return the paths in the source tree that belong to rooms, each with its room."""
    return {path: name for name in ROOMS for path in build_rooms.Rooms([], [ROOMS[name]]).excluded()}


PATHS = folder_of_rooms()


def room_of(file: Path) -> str | None:
    path = str(import_path(file))
    return next((PATHS[each] for each in PATHS if f"{path}/".startswith(f"{each}/")), None)


def sources() -> Iterator[Path]:
    """Yield all Python files of the library and the facades, and the programs of packages."""
    for root in (SRC, *FACADES):
        for file in files_below(root):
            if file.suffix == ".py" or (os.access(file, os.X_OK) and file.suffix == ""):
                yield file


def docstrings(tree: ast.AST) -> set[int]:
    """Return the lines of docstrings, which may compare with a room."""
    found = set()
    for node in ast.walk(tree):
        for field in ("body", "orelse"):
            for each in getattr(node, field, []) if isinstance(getattr(node, field, None), list) else []:
                if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant):
                    found.add(each.value.lineno)
    return found


FACADE_NAMES = {path.rpartition("/")[2]: name for path, name in PATHS.items() if "/" not in path}
COMMAND_NAMES = {
    name: room.name for room in ROOMS.values() for name in build_rooms.Rooms([], [room]).absent_commands()
}
LIMIT_NAMES = {
    name: room.name for room in ROOMS.values() if room.limits for name in loaded(room.limits)._fields
}
MODULE = re.compile(rf"\bpipros[./]({'|'.join(ROOMS)})\b")
OTHER_MEANINGS = {"rosdep"}
"""Programs of rooms whose names the core uses for something else: a subcommand of rospack, and an element."""
WORDS = {name: room for name, room in {**COMMAND_NAMES, **LIMIT_NAMES}.items() if name not in OTHER_MEANINGS}
WORD = re.compile(rf"(?<![\w/])({'|'.join(sorted(map(re.escape, WORDS), key=len, reverse=True))})(?![\w\\])")


def names_of_rooms(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield each line of a source that names a room, with the room and what names it."""
    tree = ast.parse(text)
    of_docstrings = docstrings(tree)
    for node in ast.walk(tree):
        modules: list[str] = []
        if isinstance(node, ast.Import):
            modules = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for module in modules:
            top, _, rest = module.partition(".")
            name = rest.partition(".")[0]
            if top == "pipros" and name in ROOMS:
                yield node.lineno, name, module
            elif top in FACADE_NAMES:
                yield node.lineno, FACADE_NAMES[top], module
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for found in MODULE.finditer(node.value):
                yield node.lineno, found[1], found[0]
            if node.lineno not in of_docstrings:
                for found in WORD.finditer(node.value):
                    yield node.lineno, WORDS[found[1]], found[1]


def test_no_file_names_a_room_that_may_be_missing() -> None:
    wrong = []
    for file in sources():
        own = room_of(file)
        allowed = {own, *(ROOMS[own].needs if own is not None else ())}
        for line, name, what in names_of_rooms(file.read_text(encoding="utf-8")):
            is_command = own is not None and what in COMMAND_NAMES  # a room may advise on another's
            if name not in allowed and not is_command:
                wrong.append(f"{file.relative_to(REPOSITORY)}:{line}: names the room {name}: {what}")
    assert wrong == []


WAYS = [
    ("from pipros.web.limits import PageLimits", "web"),
    ("from pipros import fleet", "fleet"),
    ("import rosapi.node", "bridges"),
    ("TARGET = 'pipros.ros2.serve:main'", "ros2"),
    ("ADVICE = 'start `pipros foxglove` there'", "bridges"),
    ("NAMES = 'rostopic rqt_plot'", "web"),
    ("limit_text('fleet_calls', 1)", "fleet"),
]


@pytest.mark.parametrize(("line", "room"), [way for way in WAYS if way[1] not in DELETED_ROOMS])
def test_each_way_to_name_a_room_is_noticed(line: str, room: str) -> None:
    assert {name for _, name, _ in names_of_rooms(line)} == {room}


def test_what_rooms_declare_exists() -> None:
    for room in ROOMS.values():
        verbs = [each for commands in room.verbs.values() for each in commands.values()]
        targets = [each.target for each in (*room.programs.values(), *room.subcommands.values(), *verbs)]
        for target in (*targets, room.limits, room.check, *room.offers.values(), *room.nodelets.values()):
            assert not target or target.startswith(f"pipros.{room.name}.")
            assert not target or loaded(target)
        assert set(room.needs) <= set(ROOMS)
    assert [path for path in PATHS if not any((root / path).exists() for root in (SRC, *FACADES))] == []
    assert len(PATHS) == sum(1 + len(room.share) + len(room.facades) for room in ROOMS.values())


def test_declarations_import_only_the_class_of_rooms() -> None:
    code = (
        "import sys; before = set(sys.modules); from pipros.basics.rooms import own_rooms; own_rooms(); "
        "print(*sorted(each for each in set(sys.modules) - before if each.startswith('pipros')))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    packages = {f"pipros.{name}{part}" for name in ROOMS for part in ("", ".room")}
    assert set(ended.stdout.split()) == {"pipros.basics", "pipros.basics.rooms", *packages}


def test_a_node_imports_neither_a_room_nor_the_server() -> None:
    code = "import rospy, sys; print(*(each for each in sys.modules if each.startswith('pipros.')))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    modules = ended.stdout.split()
    assert "pipros.node.node" in modules
    assert [each for each in modules if each.split(".")[1] in {"server", *ROOMS}] == []


def test_the_table_of_rooms_is_complete() -> None:
    text = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8").partition("## Rooms\n")[2]
    assert set(re.findall(r"`(\w+)`", text.partition("Its `room.py`")[0])) - DELETED_ROOMS == set(ROOMS)


def test_wrong_names_of_rooms_end_the_build() -> None:
    first, *_, last = [name for name, room in ROOMS.items() if not room.needs]
    known = ", ".join(ROOMS)
    with pytest.raises(build_rooms.BadRooms, match=rf"unknown room \[cellar\]; the rooms are {known}"):
        build_rooms.rooms_of(REPOSITORY, f"{first}, cellar")
    chosen = build_rooms.rooms_of(REPOSITORY, f"{last}, {first}").built
    assert [room.name for room in chosen] == [first, last]
    assert build_rooms.rooms_of(REPOSITORY, "").built == build_rooms.rooms_of(REPOSITORY).left_out == []


def test_a_build_uses_its_own_source_beside_an_installed_version(tmp_path: Path) -> None:
    startup = """import sys
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "pkg_resources": raise AssertionError("a finder of the installed version")
sys.meta_path.insert(0, Finder())
"""
    for name, text in {"__init__": "", "basics/__init__": "", "startup": startup}.items():
        file = tmp_path / "pipros" / f"{name}.py"
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    code = (
        "import sys; import pipros.startup, pipros.basics; from build_rooms import rooms_of_build; "
        "rooms = rooms_of_build(sys.argv[1]); print(*(room.name for room in rooms.built)); "
        "import pipros, importlib.util; importlib.util.find_spec('pkg_resources'); print(pipros.__file__)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code, str(REPOSITORY)],
        env={
            **os.environ,
            "PYTHONPATH": f"{tmp_path}{os.pathsep}{REPOSITORY / 'script'}",
            "PIPROS_NO_IMPORT_HOOK": "1",
        },
        capture_output=True,
        text=True,
    )

    assert ended.stdout.splitlines() == [" ".join(ROOMS), str(SRC / "pipros" / "__init__.py")], ended.stderr


def test_a_build_contains_the_chosen_rooms_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import zipfile

    chosen, *_ = [room for room in ROOMS.values() if room.extras and not room.needs and not room.programs]
    others = build_rooms.Rooms([], [room for room in ROOMS.values() if room != chosen])
    monkeypatch.setenv(build_rooms.VARIABLE, chosen.name)
    with zipfile.ZipFile(build_wheel(tmp_path)) as wheel:
        names = wheel.namelist()
        version = PROJECT["project"]["version"]
        points = wheel.read(f"pipros-{version}.dist-info/entry_points.txt").decode()
        metadata = wheel.read(f"pipros-{version}.dist-info/METADATA").decode()
        left_out = json.loads(wheel.read("pipros/left_out.json"))

    folders = {name.split("/")[1] for name in names if name.startswith("pipros/")}
    assert folders & set(ROOMS) == {chosen.name}
    stubs = [f"{package}-stubs/" for room in others.left_out for package in room.share if "/" not in package]
    absent = (*(f"{path}/" for path in others.excluded()), *stubs)
    assert [name for name in names if name.startswith(absent)] == []
    assert {"pipros/share/std_msgs/package.xml", "rospy/__init__.py"} < set(names)
    programs = {name for room in others.left_out for name in room.programs}
    assert set(re.findall(r"(?m)^(\S+) = pipros\.cli\.absent:main$", points)) == programs
    assert "rostopic = pipros.cli.rostopic:main" in points
    assert left_out == {name: [*each] for name, each in others.absent_commands().items()}
    extras = set(re.findall(r"(?m)^Provides-Extra: (\S+)", metadata))
    assert {*chosen.extras, "lz4", "dev"} < extras
    assert extras.isdisjoint(build_rooms.Rooms(others.left_out, []).extras())


def test_every_package_of_the_source_tree_is_a_room_or_has_no_declaration() -> None:
    declared = {file.parent.name for file in (SRC / "pipros").glob("*/room.py")}
    assert declared == set(ROOMS)
    assert all(ROOMS[name].name == name for name in declared)


def test_the_rooms_that_can_be_deleted_are_those_of_each_package() -> None:
    folders = REPOSITORY / "packages"
    for package in {path.name for path in folders.glob("pipros-*")} - {"pipros-internals"}:
        rooms = {file.parent.name for file in folders.glob(f"{package}/src/pipros/*/room.py")}
        assert set(PACKAGES[package]) == rooms
