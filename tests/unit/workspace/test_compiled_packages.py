from __future__ import annotations

from pathlib import Path

import pytest

from pipros.cli.rosrun import main
from pipros.workspace.compiled_packages import why_not_here


def test_a_program_in_c_plus_plus_names_its_package() -> None:
    assert why_not_here("move_base", "move_base") == (
        "The programs of move_base are C++, and do not come with pipros, which is Python alone. Run it where "
        "ROS 1 is installed (apt-get install ros-noetic-move-base): with this machine's ROS_MASTER_URI it "
        "joins the same graph."
    )
    assert why_not_here("my_package", "node") is None


def test_a_package_with_programs_of_this_machine_is_not_called_compiled() -> None:
    assert why_not_here("turtlesim", "turtlesim", (), ["turtlesim_node"]) is None
    assert why_not_here("move_base", "move_base", (), ["MoveBase.cfg"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["load", "depth_image_proc/point_cloud_xyz", "manager"],
            "The nodelet depth_image_proc/point_cloud_xyz",
        ),
        (["standalone", "pcl/VoxelGrid", "~input:=a"], "ros-noetic-nodelet ros-noetic-pcl)"),
        (["manager"], "nodelet loads C++ plugins, which pipros, Python alone, cannot. Run it"),
        (["load"], "nodelet loads C++ plugins"),
        ([], "(apt-get install ros-noetic-nodelet)"),
    ],
)
def test_a_nodelet_names_its_plugin(arguments: list[str], says: str) -> None:
    assert says in str(why_not_here("nodelet", "nodelet", arguments))


@pytest.mark.parametrize("package", ["nodelet", "move_base"])
def test_rosrun_adds_advice_after_noetics_line(
    package: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))

    assert main([package, package, "load", "image_proc/debayer"]) in (2, 3)

    assert f"apt-get install ros-noetic-{package.replace('_', '-')}" in capsys.readouterr().err
