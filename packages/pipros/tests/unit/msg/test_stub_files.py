"""Stubs that are written again when definitions change."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.spec import DefinitionError
from pipros.msg.stub_files import StubFiles, has_python_modules
from pipros_tools.cli import stubs


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


def test_a_mistake_is_reported_once_and_tried_again_after_its_correction(
    package: Path, tmp_path: Path
) -> None:
    files = StubFiles(["stubbed_robot"], tmp_path / "typings", suffix="-stubs")
    (package / "msg" / "Leg.msg").write_text("int32")
    with pytest.raises(DefinitionError, match=r"Leg\.msg"):
        files.update()
    assert files.update() == []

    (package / "msg" / "Leg.msg").write_text("int32 x\n")
    assert tmp_path / "typings" / "stubbed_robot-stubs" / "msg" / "__init__.pyi" in files.update()


def test_an_unknown_package_is_not_found_until_it_exists(package: Path, tmp_path: Path) -> None:
    files = StubFiles(["stubbed_legs"], tmp_path / "typings")
    with pytest.raises(NotFound, match="stubbed_legs"):
        files.update()


def test_files_that_an_editor_removes_while_it_saves_are_left_out(package: Path, tmp_path: Path) -> None:
    files = StubFiles(["stubbed_robot"], tmp_path / "typings")
    assert files.update()
    os.symlink("removed", package / "msg" / "Arm.msg~")  # listed, but without a status
    assert files.update() == []


def test_packages_with_python_modules_are_recognized(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
