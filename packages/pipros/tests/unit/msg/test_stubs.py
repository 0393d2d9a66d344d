"""Type stubs for editors, for each kind of field and definition."""

import ast
import itertools
import os
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import get_args

import pytest

from pipros.basics.errors import NotFound
from pipros.msg import stub_types
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import DefinitionError
from pipros.msg.stub_files import StubFiles, has_python_modules
from pipros.msg.stubs import write_stubs
from pipros_tools.cli import stubs

FILES = {
    "robot/msg/Arm.msg": (
        "float64 REACH=1e999\nstring NAME=arm\nstd_msgs/Header header\nHand[] hands\ntime since\n"
        "duration[2] spans\nuint8[] image\nfloat32[] angles\nbool[] switches\nstring class\n"
    ),
    "robot/msg/Hand.msg": "int8 fingers\n",
    "robot/msg/Eye.msg": (
        '# Sees.\n#\n# Always """open"""; \\n, \x00.\n\nuint8 OPEN=1  # wide\n'
        "uint8 state  # how\n# one byte\n# a pixel\nuint8[] pixels\n"
    ),
    "robot/srv/Grip.srv": "# Closes a hand.\n\nHand hand\n---\nbool success\n",
    "std_msgs/msg/Header.msg": "uint32 seq\ntime stamp\nstring frame_id\n",
    "empty/package.xml": "<package/>",
}


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    for path, text in FILES.items():
        file = tmp_path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return tmp_path


def stubs_of(packages: Path, *names: str, suffix: str = "") -> dict[str, str]:
    """Return the stubs of those packages, by their paths."""

    def find(name: str) -> str | None:
        return str(packages / name) if (packages / name).is_dir() else None

    folder = packages / "stubs"
    files = write_stubs(names, folder, Definitions(DefinitionFiles(find)), suffix=suffix)
    return {file.relative_to(folder).as_posix(): file.read_text() for file in files}


def test_a_package_has_a_module_for_each_kind_and_one_for_all(packages: Path) -> None:
    assert set(stubs_of(packages, "robot", suffix="-stubs")) == {
        "robot-stubs/__init__.pyi", "robot-stubs/msg/__init__.pyi", "robot-stubs/srv/__init__.pyi",
    }  # fmt: skip


def test_every_kind_of_field_has_its_type(packages: Path) -> None:
    text = stubs_of(packages, "robot")["robot/msg/__init__.pyi"]
    assert {
        "import std_msgs.msg", "class Arm(_base.Message):", "    REACH: _Final = 1e999",
        "    NAME: _Final = 'arm'", "    header: std_msgs.msg.Header", "    hands: list[Hand]",
        "    since: _time.Time", "    spans: list[_time.Duration]", "    def image(self) -> bytes: ...",
        "    def image(self, value: _types.Octets) -> None: ...",
        "    def angles(self) -> _Sequence[float]: ...",
        "    def angles(self, value: _types.Array[float]) -> None: ...", "    switches: list[bool]",
        "    fingers: int",
    } <= set(text.splitlines())  # fmt: skip
    compile(text, "stub", "exec")


def test_the_types_that_stubs_refer_to_exist(packages: Path) -> None:
    text = "\n".join(stubs_of(packages, "robot").values())
    used = set(re.findall(r"\b_types\.(\w+)", text))
    assert used == {"Array", "Octets"}
    for name in used:
        assert stub_types.SupportsArray in get_args(getattr(stub_types, name)), name


def test_a_service_names_its_halves(packages: Path) -> None:
    text = stubs_of(packages, "robot")["robot/srv/__init__.pyi"]
    assert {
        "import robot.msg", "class GripRequest(_base.Message):", "    hand: robot.msg.Hand",
        "class GripResponse(_base.Message):", "    success: bool", "class Grip:",
        "    _request_class: _ClassVar[type[GripRequest]]",
        "    _response_class: _ClassVar[type[GripResponse]]",
    } <= set(text.splitlines())  # fmt: skip
    compile(text, "stub", "exec")


def test_comments_are_docstrings(packages: Path) -> None:
    module = ast.parse(stubs_of(packages, "robot")["robot/msg/__init__.pyi"])
    (eye,) = (node for node in module.body if isinstance(node, ast.ClassDef) and node.name == "Eye")
    documented = {
        ast.unparse(before).partition(":")[0]: after.value.value
        for before, after in itertools.pairwise(eye.body)
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    }
    (pixels, *_) = (node for node in eye.body if isinstance(node, ast.FunctionDef))

    assert ast.get_docstring(eye) == 'Sees.\n\nAlways """open"""; \\n, \\x00.'
    assert documented == {"OPEN": "wide", "state": "how"}
    assert ast.get_docstring(pixels) == "one byte\na pixel"


def test_the_comment_on_a_service_is_on_its_class_and_its_request(packages: Path) -> None:
    module = ast.parse(stubs_of(packages, "robot")["robot/srv/__init__.pyi"])
    classes = {node.name: ast.get_docstring(node) for node in module.body if isinstance(node, ast.ClassDef)}
    assert classes == {"GripRequest": "Closes a hand.", "GripResponse": None, "Grip": "Closes a hand."}


def test_a_package_without_definitions_has_none(packages: Path) -> None:
    assert stubs_of(packages, "empty") == {}


def test_an_unknown_package_is_an_error(packages: Path) -> None:
    with pytest.raises(NotFound, match="no_robot"):
        stubs_of(packages, "no_robot")


def test_the_stubs_of_a_package_with_modules_do_not_hide_them(packages: Path) -> None:
    def find(name: str) -> Path | None:
        return packages / name if (packages / name).is_dir() else None

    folder = packages / "stubs"
    definitions = Definitions(DefinitionFiles(find))
    write_stubs(["robot"], folder, definitions)  # as earlier versions left them
    write_stubs(["robot"], folder, definitions, has_module={"robot"}.__contains__)

    assert not (folder / "robot/__init__.pyi").exists()
    assert (folder / "robot/py.typed").read_text() == "partial\n"
    assert (folder / "robot/msg/__init__.pyi").is_file()


# Stubs that are written again when definitions change.


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with one message, on the package path."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    folder = tmp_path / "src" / "stubbed_robot"
    (folder / "msg").mkdir(parents=True)
    (folder / "package.xml").write_text("<package/>")
    (folder / "msg" / "Arm.msg").write_text("int32 x\n")
    return folder


def test_stubs_are_written_once_for_each_change(package: Path, tmp_path: Path) -> None:
    files = StubFiles(["stubbed_robot"], tmp_path / "typings")
    module = tmp_path / "typings" / "stubbed_robot" / "msg" / "__init__.pyi"
    assert module in files.update()
    assert "class Arm(" in module.read_text()
    assert files.update() == []

    (package / "msg" / "Leg.msg").write_text("int32 x\n")
    assert module in files.update()
    assert "class Leg(" in module.read_text()
    assert files.update() == []


def test_a_mistake_is_reported_once_and_tried_again_after_its_correction(package: Path, tmp_path) -> None:
    files = StubFiles(["stubbed_robot"], tmp_path / "typings", suffix="-stubs")
    (package / "msg" / "Leg.msg").write_text("int32")
    with pytest.raises(DefinitionError, match=r"Leg\.msg"):
        files.update()
    assert files.update() == []

    (package / "msg" / "Leg.msg").write_text("int32 x\n")
    assert tmp_path / "typings" / "stubbed_robot-stubs" / "msg" / "__init__.pyi" in files.update()


def test_files_that_an_editor_removes_while_it_saves_are_left_out(package: Path, tmp_path: Path) -> None:
    files = StubFiles(["stubbed_robot"], tmp_path / "typings")
    assert files.update()
    os.symlink("removed", package / "msg" / "Arm.msg~")  # listed, but without a status
    assert files.update() == []


def test_packages_with_python_modules_are_recognized(package: Path, tmp_path: Path, monkeypatch) -> None:
    assert has_python_modules("json")
    assert not has_python_modules("stubbed_robot")
    assert not has_python_modules("no_such_module")
    assert not has_python_modules(".relative")
    monkeypatch.setitem(sys.modules, "stubbed_robot", ModuleType("stubbed_robot"))  # without a spec
    assert not has_python_modules("stubbed_robot")


@pytest.mark.parametrize("place", range(3))
def test_a_package_without_stubs_does_not_keep_the_others_from_theirs(
    place: int, package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (package / "msg" / "Leg.msg").write_text("int32")
    names = ["std_msgs", "geometry_msgs"]
    names.insert(place, package.name)
    assert stubs.main([*names, "-o", str(tmp_path / "typings")]) == 1
    out, err = capsys.readouterr()
    assert all(f"{name}/msg/__init__.pyi" in out for name in names if name != package.name)
    assert "Leg.msg" in err
