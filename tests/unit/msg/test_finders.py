"""The import finders of ROS packages, in this process. `test_hook.py` starts new ones."""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import pytest

import pipros.msg
from pipros.basics.errors import NotFound
from pipros.msg.importing import hook
from pipros.msg.importing.hook import InterfaceFinder, PackageFinder, WorkspaceFinder
from pipros.msg.importing.load import load_message_class, load_service_class


class Packages:
    """Packages in a folder, and a record of the searches."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.asked: list[str] = []

    def write(self, path: str, text: str = "") -> None:
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def find(self, name: str) -> str | None:
        self.asked.append(name)
        folder = self.folder / name
        return str(folder) if folder.is_dir() else None


@pytest.fixture
def packages(tmp_path: Path) -> Packages:
    return Packages(tmp_path)


def test_names_that_cannot_be_ros_packages_are_not_searched(packages: Packages) -> None:
    finder = PackageFinder(packages.find)
    for name in ("json", "_private", "a.b", "pipros", "sitecustomize"):
        assert finder.find_spec(name) is None
    assert packages.asked == []


def test_a_package_of_definitions_is_found(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "int8 x")
    spec = PackageFinder(packages.find).find_spec("robot")
    assert spec is not None
    assert list(spec.submodule_search_locations or ()) == [str(packages.folder / "robot/src/robot")]


def test_a_package_with_python_modules_is_imported_from_them(packages: Packages) -> None:
    packages.write("robot/src/robot/__init__.py")
    spec = PackageFinder(packages.find).find_spec("robot")
    assert spec is not None
    assert spec.origin == str(packages.folder / "robot/src/robot/__init__.py")


def test_a_package_without_definitions_is_left_to_other_finders(packages: Packages) -> None:
    packages.write("robot/package.xml")
    assert PackageFinder(packages.find).find_spec("robot") is None
    assert PackageFinder(packages.find).find_spec("no_robot") is None


def test_the_start_of_python_does_not_search_for_packages(
    packages: Packages, monkeypatch: pytest.MonkeyPatch
) -> None:
    packages.write("robot/msg/Arm.msg", "int8 x")
    running = ModuleType("usercustomize")
    running.__spec__ = ModuleSpec("usercustomize", None)
    monkeypatch.setitem(sys.modules, "usercustomize", running)
    monkeypatch.setattr(running.__spec__, "_initializing", True, raising=False)  # as importlib does it
    assert PackageFinder(packages.find).find_spec("robot") is None
    monkeypatch.setattr(running.__spec__, "_initializing", False)
    assert PackageFinder(packages.find).find_spec("robot") is not None


def test_only_messages_and_services_are_found_in_a_package(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "int8 x")
    finder = InterfaceFinder(packages.find, None)
    found = finder.find_spec("robot.msg")
    assert found is not None
    assert found.name == "robot.msg"
    for name in ("robot", "robot.tools", "robot.msg.tools", "robot.srv", "no_robot.msg", "json.msg"):
        assert finder.find_spec(name) is None


def test_a_type_is_only_found_in_a_package_that_was_made_from_definitions(packages: Packages) -> None:
    packages.write("robot/msg/Arm.msg", "int8 x")
    assert InterfaceFinder(packages.find, None).find_spec("robot.msg._Arm") is None


def test_installing_the_hook_twice_changes_nothing() -> None:
    before = list(sys.meta_path)
    hook.install()
    assert sys.meta_path == before


def test_loading_a_type_installs_the_missing_hook(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "meta_path", [])
    library = hook.installed_library()
    assert [type(finder) for finder in sys.meta_path] == [InterfaceFinder, WorkspaceFinder, PackageFinder]
    assert hook.installed_library() is library
    assert "String" in library.files.names("msg", "std_msgs")


def test_loading_an_unknown_type_explains_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_service_class("std_srvs/Empty")._type == "std_srvs/Empty"
    with pytest.raises(NotFound, match=r"a type name must have the form package/Name, got \[String\]"):
        load_message_class("String")
    monkeypatch.setitem(sys.modules, "std_msgs.msg", ModuleType("std_msgs.msg"))
    with pytest.raises(NotFound, match=r"defines std_msgs/String, but the Python package std_msgs hides it"):
        load_message_class("std_msgs/String")


def test_the_package_loads_its_public_names_on_demand() -> None:
    for name in pipros.msg.__all__:
        assert getattr(pipros.msg, name).__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        pipros.msg.nothing  # noqa: B018
