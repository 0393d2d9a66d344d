from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace

from pipros.packages.completed_modules import add_distributions, add_folders, spec

MODULE = "rospkg.environment"


def load(path: list[str], *shares: str) -> ModuleType:
    found = spec(MODULE, path, partial(add_folders, shares=shares))
    assert found is not None
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
        [sys.executable, "-W", "ignore", *options, "-c", code],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
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


def test_pip_lists_pipros_alone() -> None:
    listed = run(
        "import runpy, sys; sys.argv = ['pip', 'list']; runpy.run_module('pip', run_name='__main__')"
    )
    assert "pipros" in listed
    assert "rospy" not in listed


def test_an_installed_distribution_wins_over_that_of_pipros(tmp_path: Path) -> None:
    folder = tmp_path / "rospy-9.9.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: rospy\nVersion: 9.9\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import pkg_resources as p; "
    assert run(code + "print(p.get_distribution('rospy').version)") == "9.9"


def test_shipped_packages_are_distributions_that_pkg_resources_does_not_list() -> None:
    added: dict[str, tuple[str, str, bool]] = {}

    class WorkingSet:
        def add(self, distribution: tuple[str, str, str], insert: bool) -> None:
            folder, name, version = distribution
            added[name] = folder, version, insert

    module = SimpleNamespace(
        Distribution=lambda folder, project_name, version: (folder, project_name, version),
        working_set=WorkingSet(),
    )

    add_distributions(module)

    folder, version, is_listed = added["rospy"]
    assert (Path(folder).name, version, is_listed) == ("rospy", "1.15.15", False)
    assert folder not in sys.path
    assert "message_generation" not in added  # a package without Python modules
