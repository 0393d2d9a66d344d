import importlib
import importlib.util
import re
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.packages import shipped_folder
from pipros.packages.well_known import _PROGRAMS, why_no_command, why_no_nodelet, why_not_here
from pipros_tools.cli.complete import main as complete
from pipros_tools.cli.rosmsg import main as rosmsg
from pipros_tools.cli.rospack import main as rospack
from pipros_tools.cli.rosrun import main
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.find_launch_files import find_in_package
from pipros_tools.launch.load_context import find_resource
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.xml import load
from pipros_workspace.index import PackageIndex
from pipros_workspace.setup_files import SHELL_FOLDER
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


@pytest.mark.parametrize(("name", "says"), [
    ("gazebo", "On this machine, roslaunch pipros_sim sim.launch simulates robots"),
    ("xacro", "xacro is not installed. It comes from PyPI: "),
    ("catkin", "catkin is not part of pipros, but is on PyPI: pip install catkin-tools"),
])  # fmt: skip
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


@pytest.mark.parametrize(("system", "advice"), [
    ("ID=debian\nNAME='Debian GNU/Linux'\n", "Debian has it: apt-get install ros-image-proc"),
    ('ID=linuxmint\nID_LIKE="ubuntu debian"\nNAME="Linux Mint"', "Linux Mint has it: apt-get"),
    ("ID=ubuntu\nVERSION_CODENAME=focal\n", "Install it (apt-get install ros-noetic-image-proc)"),
    ("ID=fedora\nNAME=Fedora\n", "Fedora has no package for image_proc. Run it where ROS 1 Noetic is "),
    (None, "This system has no package for image_proc. "),
])  # fmt: skip
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
        "ROS_PACKAGE_PATH are enough. git clone https://github.com/ros-drivers/rosserial (a branch for "
        "ROS 1) into the src folder of a workspace."
    )
    assert why_not_here("smach", ["viewer"]) is None
    assert why_not_here("turtlebot3_slam", []) is None  # the sources are here already
    assert why_not_here("my_package") is None


@pytest.mark.parametrize(
    "package", ["gazebo_ros", "rosserial_python", "rqt_shell", "mavros_msgs", "moveit_commander"]
)
def test_all_tools_give_the_same_advice(package: str, monkeypatch, tmp_path: Path, capsys) -> None:
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
    assert rospack(["find", package]) == 1
    assert capsys.readouterr().err == (
        f"[rospack] Error: package '{package}' not found\n[rospack] {advice}\n"
    )
    assert complete(["--similar", package]) == 0  # roscd and the other functions of the shell
    assert capsys.readouterr().out == f"{advice}\n"
    with pytest.raises(ModuleNotFoundError, match=re.escape(f"No module named '{package}': {advice}")):
        importlib.import_module(f"{package}.anything")


@pytest.mark.parametrize("name", ["std_msg", "geometry_mgs", "turtlsim"])
def test_similar_packages_are_suggested(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"Did you mean .*; is .* of its workspace sourced"):
        importlib.import_module(f"{name}.msg")
    assert rospack(["find", name]) == 1
    assert "Did you mean" in capsys.readouterr().err
    with pytest.raises(NotFound, match=r"there is no package .*: Did you mean"):
        DefinitionFiles(lambda _name: None).folder(name)


@pytest.mark.parametrize(("module", "advice"), [
    ("smach", "git clone https://github.com/ros/executive_smach"),
    ("smach_ros", "git clone https://github.com/ros/executive_smach"),
    ("smach_viewer", "Run it where ROS 1 is installed"),
    ("moveit_commander", "Run it where ROS 1 is installed"),
])  # fmt: skip
def test_the_import_of_a_package_that_is_not_included_gives_advice(module: str, advice: str) -> None:
    with pytest.raises(ModuleNotFoundError, match=re.escape(advice)) as caught:
        importlib.import_module(module)
    assert caught.value.name == module
    assert advice in (why_not_here(module) or "")


@pytest.mark.parametrize("name", [
    "mavros_msgs", "gazebo_msgs", "moveit_msgs", "vision_msgs", "octomap_msgs", "nmea_msgs", "velodyne_msgs",
    "jsk_recognition_msgs", "audio_common_msgs", "people_msgs", "rosserial_msgs", "ros_numpy", "geodesy",
    "unique_id", "py_trees_ros",
])  # fmt: skip
def test_public_packages_that_pipros_lacks_have_advice(name: str) -> None:
    with pytest.raises(
        ModuleNotFoundError, match=f"^No module named '{name}': {name} does not come with pipros"
    ):
        importlib.import_module(name)


def test_an_unknown_package_of_messages_names_the_places_that_were_searched(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))

    with pytest.raises(ModuleNotFoundError, match=r"my_arm_msgs.*ROS_PACKAGE_PATH is .*sourced") as caught:
        importlib.import_module("my_arm_msgs.msg")

    assert caught.value.name == "my_arm_msgs"


def test_other_modules_keep_the_text_of_python() -> None:
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module("my_arm_tools")
    assert str(caught.value) == "No module named 'my_arm_tools'"


@pytest.mark.parametrize("name", ["mavros_msgs", "my_arm_msgs", "smach", "rqt_gui_py"])
def test_a_program_that_asks_whether_a_module_is_there_is_told_no(name: str) -> None:
    assert importlib.util.find_spec(name) is None


@pytest.mark.parametrize(("package", "program", "instead"), [
    ("image_view", "extract_images", "rosbag export"), ("image_view", "video_recorder", "rosbag export"),
    ("xacro", "xacro.py", "rosrun xacro xacro"),
    ("costmap_2d", "costmap_2d_markers", "a display of the type Map"),
])  # fmt: skip
def test_a_program_that_a_package_lacks_names_what_to_use(
    package: str, program: str, instead: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([package, program]) == 3
    advice = str(why_not_here(package, ["anything"], program))
    assert instead in advice
    assert advice in capsys.readouterr().err

    file = tmp_path / "a.launch"
    file.write_text(f'<launch><node pkg="{package}" type="{program}" name="n"/></launch>')
    maker = CommandMaker(PackageIndex.from_environment(), {}, tmp_path)
    with pytest.raises(CannotLaunch, match=re.escape(advice)):
        maker.make(load([str(file)]).nodes[0], "http://m:1")


def test_the_table_of_programs_names_only_programs_that_are_absent_from_packages_that_are_here() -> None:
    for package, programs in _PROGRAMS.items():
        files = {path.name for path in Path(shipped_folder(package) or "").rglob("*")}
        assert "package.xml" in files
        assert not files & programs.keys()
        assert all(program in str(why_no_command(program)) for program in programs)
