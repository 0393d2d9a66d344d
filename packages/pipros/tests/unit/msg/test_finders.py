"""The import finders of ROS packages, in this process. `test_hook.py` starts new ones."""

import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

import pytest

import pipros.msg
from pipros.msg.importing import hook
from pipros.msg.importing.hook import InterfaceFinder, PackageFinder, WorkspaceFinder
from pipros.packages import ament_index_python


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
    assert list(spec.submodule_search_locations or ()) == [str(packages.folder / "robot/src/robot")]


def test_a_package_with_python_modules_is_imported_from_them(packages: Packages) -> None:
    packages.write("robot/src/robot/__init__.py")
    spec = PackageFinder(packages.find).find_spec("robot")
    assert spec.origin == str(packages.folder / "robot/src/robot/__init__.py")


def test_a_package_without_definitions_is_left_to_other_finders(packages: Packages) -> None:
    packages.write("robot/package.xml")
    assert PackageFinder(packages.find).find_spec("robot") is None
    assert PackageFinder(packages.find).find_spec("no_robot") is None


def test_the_start_of_python_does_not_search_for_packages(packages: Packages, monkeypatch) -> None:
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
    assert finder.find_spec("robot.msg").name == "robot.msg"
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


def test_the_package_loads_its_public_names_on_demand() -> None:
    for name in pipros.msg.__all__:
        assert getattr(pipros.msg, name).__name__ == name
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        pipros.msg.nothing  # noqa: B018


def test_declared_modules_are_imported_from_their_paths(packages: Packages) -> None:
    packages.write("driver/python/lib.py")
    packages.write("robot/setup.py")
    paths = {
        ("lib", None): str(packages.folder / "driver/python/lib.py"),
        ("robot", str(packages.folder / "robot")): str(packages.folder / "robot/python/robot"),
    }
    finder = PackageFinder(packages.find, lambda *asked: paths.get(asked))

    module, package = finder.find_spec("lib"), finder.find_spec("robot")
    assert package is not None
    assert (module.origin, module.submodule_search_locations) == (paths["lib", None], None)
    assert package.submodule_search_locations == [str(packages.folder / "robot/python/robot")]
    assert finder.find_spec("nothing") is None


def test_xacro_2_finds_its_dependency_and_other_modules_do_not(packages: Packages, monkeypatch) -> None:
    finder = PackageFinder(packages.find)
    monkeypatch.delitem(sys.modules, "xacro", raising=False)
    assert finder.find_spec("ament_index_python") is None
    monkeypatch.setitem(sys.modules, "xacro", ModuleType("xacro"))
    assert finder.find_spec("ament_index_python").origin == ament_index_python.__file__


def test_a_package_that_a_folder_of_its_name_hides_is_completed(packages: Packages, monkeypatch) -> None:
    packages.write("robot/src/robot/__init__.py", "ready = True")
    packages.write("robot/src/robot/tools.py")
    hidden = ModuleType("robot")
    hidden.__path__ = [str(packages.folder / "robot")]  # as Python sets it for a namespace package
    monkeypatch.setitem(sys.modules, "robot", hidden)

    spec = PackageFinder(packages.find).find_spec("robot.tools")
    assert spec.origin == str(packages.folder / "robot/src/robot/tools.py")
    assert hidden.__dict__["ready"]
    assert hidden.__file__ == str(packages.folder / "robot/src/robot/__init__.py")


def test_a_namespace_without_a_python_package_is_left_alone(packages: Packages, monkeypatch) -> None:
    packages.write("robot/msg/Arm.msg", "int8 x")
    hidden = ModuleType("robot")
    hidden.__path__ = [str(packages.folder / "robot")]
    monkeypatch.setitem(sys.modules, "robot", hidden)

    assert PackageFinder(packages.find).find_spec("robot.tools") is None
    assert hidden.__path__ == [str(packages.folder / "robot")]


class Overlaid:
    """A workspace on `ROS_PACKAGE_PATH`, whose packages all have Python modules, and its finder."""

    def __init__(self, packages: Packages) -> None:
        self.packages = packages
        self.asked: list[tuple[str, str]] = []
        self.finder = WorkspaceFinder(self._find)

    def _find(self, name: str, package: str) -> str:
        self.asked.append((name, package))
        return str(self.packages.folder / name / "src" / name)

    def origin(self, name: str) -> str | None:
        spec = self.finder.find_spec(name)
        return None if spec is None else spec.origin


@pytest.fixture
def overlaid(packages: Packages, monkeypatch: pytest.MonkeyPatch) -> Overlaid:
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{packages.folder / 'missing'}:{packages.folder}:")
    return Overlaid(packages)


def test_a_changed_package_path_is_noticed(overlaid: Overlaid, monkeypatch: pytest.MonkeyPatch) -> None:
    overlaid.packages.write("xacro/package.xml")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(overlaid.packages.folder / "missing"))
    assert overlaid.origin("xacro") is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(overlaid.packages.folder))
    assert overlaid.origin("xacro") == str(overlaid.packages.folder / "xacro/src/xacro/__init__.py")


def test_the_ros_package_of_a_module_may_have_another_name(overlaid: Overlaid) -> None:
    overlaid.packages.write("urdfdom_py/package.xml")
    assert overlaid.origin("urdf_parser_py") is not None
    assert overlaid.asked == [("urdf_parser_py", "urdfdom_py")]


def test_packages_are_noticed_in_folders_of_the_workspace_but_not_in_packages(overlaid: Overlaid) -> None:
    overlaid.packages.write("robot/package.xml")
    overlaid.packages.write("robot/xacro/package.xml")
    overlaid.packages.write(".git/xacro/package.xml")
    overlaid.packages.write("one/two/three/xacro/package.xml")
    assert overlaid.origin("xacro") is None
    assert overlaid.asked == []

    overlaid.packages.write("one/two/xacro/package.xml")
    assert Overlaid(overlaid.packages).origin("xacro") is not None


@pytest.mark.parametrize("name", ["xacro.cli", "json", "pipros", "_private", "yaml", "robot", "rospy"])
def test_other_modules_are_not_taken_from_the_workspace(overlaid: Overlaid, name: str) -> None:
    """Modules of Python and of pipros, modules that pipros imports, and a module that is not installed."""
    overlaid.packages.write(f"{name}/package.xml")
    assert overlaid.origin(name) is None
    assert overlaid.asked == []
