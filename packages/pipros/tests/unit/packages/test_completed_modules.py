"""Modules and distributions of others that pipros completes, or replaces by advice."""

import importlib.metadata
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest

import pipros.startup  # noqa: F401 # what pipros.pth imports
from pipros.packages import SHARE
from pipros.packages.ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from pipros.packages.completed_modules import add_folders, spec
from pipros.packages.distributions import shipped_distribution

MODULE = "rospkg.environment"


def load(path: list[str], *shares: str) -> ModuleType:
    found = spec(MODULE, path, partial(add_folders, shares=shares))
    assert found.loader is not None
    module = ModuleType(MODULE)
    found.loader.exec_module(module)
    return module


def test_the_folders_are_added_once_at_the_end(tmp_path: Path) -> None:
    (tmp_path / "environment.py").write_text(
        "def get_ros_paths(env=None):\n    return list((env or {}).get('P', ()))\n"
    )
    module = load([str(tmp_path)], "/share", "/more")
    assert module.get_ros_paths() == ["/share", "/more"]
    assert module.get_ros_paths({"P": ["/a", "/more", "/share"]}) == ["/a", "/share", "/more"]
    assert module.get_ros_paths(env={"P": ["/share", "/b"]}) == ["/share", "/b", "/more"]


def test_rospkg_itself_has_the_function(tmp_path: Path) -> None:
    import rospkg

    module = load(list(rospkg.__path__), "/share")
    assert module.get_ros_paths({"ROS_PACKAGE_PATH": "/a"})[-1] == "/share"


def test_without_rospkg_there_is_no_module(tmp_path: Path) -> None:
    assert spec(MODULE, [str(tmp_path)]) is None
    assert str(tmp_path) not in sys.path


def run(code: str, *options: str) -> str:
    """Return the output of a program with an old setuptools; its warning about pkg_resources is expected."""
    ended = subprocess.run(
        [sys.executable, "-W", "ignore", *options, "-c", code], capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.strip()


def test_pkg_resources_finds_the_packages_of_pipros_by_name_but_does_not_list_them() -> None:
    code = (
        "import pkg_resources as p; names = {d.project_name for d in p.working_set}; "
        "print('pipros' in names, names & {'rospy', 'genpy'}); "
        "print(p.get_distribution('rospy').version, p.parse_version(p.require"
        "('genpy')[0].version) > p.parse_version('0.6'), p.get_distribution('sensor_msgs').project_name)"
    )
    assert run(code) == "True set()\n1.15.15 True sensor-msgs"


def test_an_installed_distribution_wins_over_that_of_pipros(tmp_path: Path) -> None:
    folder = tmp_path / "rospy-9.9.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: rospy\nVersion: 9.9\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import pkg_resources as p; "
    assert run(code + "print(p.get_distribution('rospy').version)") == "9.9"


# Modules of Noetic that pipros does not have.


QT = ("python_qt_binding.QtWidgets", "qt_gui.plugin", "rqt_gui.main", "rqt_gui_py.plugin", "rqt_py_common")


IMPORT_EACH = """
import sys
from importlib import import_module
sys.path = [path for path in sys.path if not path.endswith('-packages')]  # hides em
for name in sys.argv[1:]:
    try:
        import_module(name)
        print("imported")
    except ImportError as error:
        print(f"{type(error).__name__}: {error}")
"""


def imports(folder: Path, *modules: str) -> list[str]:
    """Return the errors of a program in a folder that imports each module, or `imported`."""
    command = [sys.executable, "-c", IMPORT_EACH, *modules]
    ended = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, timeout=60, check=True)
    return ended.stdout.splitlines()


def test_imports_of_modules_that_are_absent_name_the_alternative(tmp_path: Path) -> None:
    *of_qt, of_em = imports(tmp_path, *QT, "em")
    assert of_em.endswith("pip install 'pipros[templates]'")
    advice = (
        "pipros shows no Qt plugins. Its rqt is a page in the browser: rqt_graph, rqt_plot, rqt_console, "
        "rqt_image_view, rqt_reconfigure, rqt_tf_tree and others"
    )
    names = [module.partition(".")[0] for module in QT]
    assert of_qt == [f"ModuleNotFoundError: {name} is not installed: {advice}" for name in names]


def test_a_module_that_is_installed_is_imported(tmp_path: Path) -> None:
    (tmp_path / "qt_gui").mkdir()
    for name in ("em.py", "qt_gui/__init__.py", "qt_gui/plugin.py"):
        (tmp_path / name).touch()
    assert imports(tmp_path, "em", "qt_gui.plugin") == ["imported"] * 2


def test_a_script_works_without_the_module() -> None:
    with pytest.raises(ModuleNotFoundError, match="python_qt_binding") as error:
        import python_qt_binding  # type: ignore[import-not-found] # noqa: F401
    assert error.value.name == "python_qt_binding"


# The part of ament_index_python that xacro 2 imports.


def test_shipped_packages_are_found() -> None:
    assert get_package_share_directory("std_msgs") == str(Path(SHARE, "std_msgs"))


def test_a_missing_package_is_an_error_that_names_it() -> None:
    with pytest.raises(PackageNotFoundError, match="there is no package no_such_package"):
        get_package_share_directory("no_such_package")


# Versions of the Python packages of ROS in `importlib.metadata`.


@pytest.mark.parametrize(
    ("name", "version"),
    [("rospy", "1.15.15"), ("roslib", "1.15.8"), ("genpy", "0.6.16"), ("sensor-msgs", "1.13.1")],
)
def test_versions_are_those_of_the_manifests(name: str, version: str) -> None:
    assert importlib.metadata.version(name) == version
    assert importlib.metadata.metadata(name)["Name"] == name.replace("-", "_")
    assert importlib.metadata.requires(name) is None


@pytest.mark.parametrize("name", ["no_such_package", "std_msgs", "..", "", "rospy/msg"])
def test_names_without_python_modules_have_no_distribution(name: str) -> None:
    assert shipped_distribution(name) is None


def test_lists_of_what_is_installed_leave_them_out(tmp_path: Path) -> None:
    assert "rospy" not in {found.name for found in importlib.metadata.distributions()}
    assert list(importlib.metadata.distributions(name="rospy", path=[str(tmp_path)])) == []


def test_an_installed_distribution_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "rospy-9.9.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: rospy\nVersion: 9.9\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert importlib.metadata.version("rospy") == "9.9"
