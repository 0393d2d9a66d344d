from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.cli.rosmsg import main as rosmsg
from pipros.cli.rosrun import main
from pipros.launch.find_launch_files import find_in_package
from pipros.launch.load_context import find_resource
from pipros.launch.model import LaunchError
from pipros.packages.well_known import why_no_command, why_no_nodelet, why_not_here
from pipros.workspace.index import PackageIndex
from pipros.workspace.setup_files import SHELL_FOLDER
from tests.support.debian_system import make_debian


@pytest.fixture(autouse=True)
def on_debian(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = tmp_path / "debian"
    system.write_text('ID=debian\nNAME="Debian GNU/Linux"\n')
    monkeypatch.setattr("pipros.packages.apt_names.OS_RELEASE", str(system))


def test_a_program_in_c_plus_plus_names_its_package() -> None:
    assert why_not_here("hector_mapping") == (
        "The programs of hector_mapping are written in C++, and are not part of pipros, which is pure "
        "Python. Debian has no package for hector_mapping. Run it where ROS 1 Noetic is installed (Ubuntu "
        "20.04: apt-get install ros-noetic-hector-mapping): with this machine's ROS_MASTER_URI, it joins the "
        "same graph. On this machine, rosrun gmapping slam_gmapping builds maps, also with the simulator: "
        "roslaunch pipros_sim sim.launch."
    )
    assert why_not_here("my_package") is None


def test_a_package_of_launch_files_names_the_programs_that_they_start() -> None:
    advice = str(why_not_here("hector_slam_launch"))
    assert advice.startswith(
        "hector_slam_launch starts programs in C++, which are not part of pipros: hector_m"
    )
    assert "On this machine, rosrun gmapping slam_gmapping" in advice


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("gazebo", "On this machine, roslaunch pipros_sim sim.launch simulates robots"),
        ("catkin", "catkin is not part of pipros, but is on PyPI: pip install catkin-tools"),
    ],
)
def test_commands_that_are_not_here_name_a_substitute(name: str, says: str) -> None:
    assert says in str(why_no_command(name))
    assert why_no_command("ls") is None


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_shell_functions_know_the_same_commands(shell: str) -> None:
    code = (SHELL_FOLDER / f"ros.{shell}").read_text()
    names = re.search(r"(catkin \|[^)]*)\)", code)[1].split(" | ")  # type: ignore[index]
    assert all(why_no_command(name) for name in names)
    assert f"case {' '.join(names)}" in (SHELL_FOLDER / "ros.fish").read_text()


def test_a_package_with_programs_of_this_machine_is_not_called_compiled() -> None:
    assert why_not_here("turtlesim", ["turtlesim_node"]) is None
    assert why_not_here("teb_local_planner", ["Teb.cfg"])


def test_a_nodelet_names_its_plugin() -> None:
    assert why_no_nodelet("pcl/VoxelGrid") == (
        "The nodelet pcl/VoxelGrid is a C++ plugin, which pipros, being pure Python, cannot load. Debian has "
        "it: apt-get install libnodeletlib-tools libpcl-ros-dev"
    )
    advice = why_no_nodelet("velodyne_pointcloud/CloudNodelet")
    assert "Debian has no package for velodyne_pointcloud." in advice


@pytest.mark.parametrize(
    ("system", "advice"),
    [
        ("ID=debian\nNAME='Debian GNU/Linux'\n", "Debian has it: apt-get install ros-image-proc"),
        (
            'ID=linuxmint\nID_LIKE="ubuntu debian"\nNAME="Linux Mint"',
            "Linux Mint has it: apt-get",
        ),
        (
            "ID=ubuntu\nVERSION_CODENAME=focal\n",
            "Install it (apt-get install ros-noetic-image-proc)",
        ),
        ("ID=fedora\nNAME=Fedora\n", "Fedora has no package for image_proc. Run it where ROS 1 Noetic is "),
        (None, "This system has no package for image_proc. "),
    ],
)
def test_advice_names_the_package_of_the_running_distribution(
    system: str | None, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if system is not None:
        (tmp_path / "os-release").write_text(system)
    monkeypatch.setattr("pipros.packages.apt_names.OS_RELEASE", str(tmp_path / "os-release"))
    assert advice in str(why_not_here("image_proc"))


@pytest.mark.parametrize(("package", "code"), [("octomap_server", 2), ("teb_local_planner", 2)])
def test_rosrun_adds_advice_after_noetics_line(
    package: str,
    code: int,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    make_debian(tmp_path, monkeypatch)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)

    assert main([package, package, "load", "image_proc/debayer"]) == code

    complaint = capsys.readouterr().err
    assert f"ros-noetic-{package.replace('_', '-')}" in complaint
    assert "source the setup file" not in complaint  # that would not help


def test_roslaunch_omits_advice_that_does_not_help(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    for package, helps in (("octomap_server", False), ("my_package", True)):
        with pytest.raises(LaunchError) as refused:
            find_in_package(package, "a.launch", PackageIndex.from_environment())
        assert ("source the setup file" in str(refused.value)) is helps


def test_sources_are_enough_for_packages_without_c_plus_plus() -> None:
    assert why_not_here("rosserial_python") == (
        "rosserial_python does not come with pipros, but needs no compiler: its sources on "
        "ROS_PACKAGE_PATH are enough. git clone them into the src folder of a workspace."
    )
    assert why_not_here("smach", ["viewer"]) is None
    assert why_not_here("turtlebot3_slam", []) is None  # the sources are here already
    assert why_not_here("my_package") is None


@pytest.mark.parametrize("package", ["gazebo_ros", "rosserial_python", "rqt_shell"])
def test_all_tools_give_the_same_advice(
    package: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    advice = str(why_not_here(package))
    assert main([package, "any_program"]) == 2
    printed = capsys.readouterr().err
    assert advice in printed
    assert "Did you mean" not in printed
    with pytest.raises(LaunchError) as launch:
        find_in_package(package, "any.launch", PackageIndex.from_environment())
    assert advice in str(launch.value)
    with pytest.raises(NotFound, match=re.escape(advice)):
        find_resource(PackageIndex.from_environment(), package, "launch/any.launch")
    assert rosmsg(["show", f"{package}/Type"]) == 1
    assert advice in capsys.readouterr().err


@pytest.mark.parametrize(
    ("module", "advice"),
    [
        ("smach", "git clone https://github.com/ros/executive_smach"),
        ("smach_ros", "git clone https://github.com/ros/executive_smach"),
        ("smach_viewer", "Run it where ROS 1 is installed"),
        ("moveit_commander", "Run it where ROS 1 is installed"),
    ],
)
def test_the_import_of_a_package_that_is_not_included_gives_advice(module: str, advice: str) -> None:
    with pytest.raises(ModuleNotFoundError, match=re.escape(advice)) as caught:
        importlib.import_module(module)
    assert caught.value.name == module
    assert advice in (why_not_here(module) or "")
