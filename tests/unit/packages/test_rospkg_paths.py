from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

from pipros.packages.rospkg_paths import MODULE, spec


def load(path: list[str], folder: str) -> ModuleType:
    found = spec(path, folder)
    assert found is not None
    assert found.loader is not None
    module = ModuleType(MODULE)
    found.loader.exec_module(module)
    return module


def test_the_folder_comes_last_and_once(tmp_path: Path) -> None:
    (tmp_path / "environment.py").write_text(
        "def get_ros_paths(env=None):\n    return list((env or {}).get('P', ()))\n"
    )
    module = load([str(tmp_path)], "/share")
    assert module.get_ros_paths() == ["/share"]
    assert module.get_ros_paths({"P": ["/a", "/b"]}) == ["/a", "/b", "/share"]
    assert module.get_ros_paths(env={"P": ["/share", "/b"]}) == ["/share", "/b"]


def test_rospkg_itself_has_the_function(tmp_path: Path) -> None:
    import rospkg

    module = load(list(rospkg.__path__), "/share")
    assert module.get_ros_paths({"ROS_PACKAGE_PATH": "/a"})[-1] == "/share"


def test_without_rospkg_there_is_no_module(tmp_path: Path) -> None:
    assert spec([str(tmp_path)], "/share") is None
    assert MODULE.partition(".")[0] == "rospkg"
    assert str(tmp_path) not in sys.path
