"""Workspaces, bags and logs in places of Windows: several drives, shares, long paths, names without case."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import windows
from tests.support.environments import EXAMPLES
from tests.support.waiting import wait_until
from tests.support.windows import DRIVE, WindowsProgram
from tests.windows.conftest import StartOnWindows

pytestmark = pytest.mark.timeout(500)  # on busy processors, building a workspace takes minutes under Wine

HOME = "C:\\users\\Jürgen Müller 王"
_OTHER_DRIVE = r"""
file(RELATIVE_PATH there ${CMAKE_CURRENT_SOURCE_DIR} C:/temp)
file(GLOB launch_files RELATIVE C:/temp ${CMAKE_CURRENT_SOURCE_DIR}/launch/*.launch)
message(STATUS "there=${there}, launch=${launch_files}")
"""


@pytest.fixture
def drives(environment: None) -> Iterator[Path]:
    r"""Have the drives D and E and the share `\\lab\share`, whose folders are in the folder returned."""
    folder = windows.FOLDER / "drives"
    shutil.rmtree(folder, ignore_errors=True)
    devices = windows.PREFIX / "dosdevices"
    for device, name in (("d:", "d"), ("e:", "e"), ("unc/lab/share", "share")):
        (folder / name).mkdir(parents=True)
        (devices / device).parent.mkdir(parents=True, exist_ok=True)
        (devices / device).unlink(missing_ok=True)
        (devices / device).symlink_to(folder / name)
    yield folder
    windows.end_programs()
    for device in ("d:", "e:", "unc/lab/share"):
        (devices / device).unlink()
    shutil.rmtree(folder)


def output_of(command: str, folder: Path = DRIVE, code: int = 0, **variables: str) -> str:
    """Run a program, check its exit code, and return its output."""
    program = WindowsProgram(command.split("|"), variables, folder)
    try:
        assert program.wait(200) == code, program.output
    finally:
        windows.end_programs()
        program.close()
    return program.output


def test_source_build_and_home_may_be_on_different_drives(drives: Path) -> None:
    package = drives / "d" / "src" / "composiv_tryouts"
    shutil.copytree(EXAMPLES / "composiv_tryouts", package)
    with (package / "CMakeLists.txt").open("a") as file:
        file.write(_OTHER_DRIVE)
    shutil.rmtree(DRIVE / "temp" / "built", ignore_errors=True)
    prefixes = r"-DCATKIN_DEVEL_PREFIX=E:\devel|-DCMAKE_INSTALL_PREFIX=E:\installed"
    built = output_of(rf"catkin_make|--source|D:\src|--build|C:\temp\built|{prefixes}|install")
    assert "there=C:/temp, launch=D:/src/composiv_tryouts/launch/composiv_tryout.launch" in built
    assert (drives / "e" / "installed" / "share" / "composiv_tryouts" / "package.xml").exists()
    tested = output_of(
        r"rostest|D:\src\composiv_tryouts\launch\composiv_tryout.launch", ROS_PACKAGE_PATH=r"D:\src",
        CMAKE_PREFIX_PATH=r"E:\devel", USERPROFILE=HOME, ROS_HOME=r"E:\ros home",
    )  # fmt: skip
    assert "RESULT: SUCCESS" in tested
    assert list((drives / "e" / "ros home" / "test_results").rglob("*.xml"))


def test_a_workspace_may_be_on_a_share(drives: Path) -> None:
    shutil.rmtree(DRIVE / "temp" / "built", ignore_errors=True)
    package = drives / "share" / "ws" / "src" / "composiv_tryouts"  # its build starts no program, which under
    shutil.copytree(EXAMPLES / package.name, package)  # Wine would not start in a folder of a share
    with (package / "CMakeLists.txt").open("a") as file:
        file.write(_OTHER_DRIVE)
    built = output_of(r"catkin_make|--source|\\lab\share\ws\src|--build|C:\temp\built")
    assert "there=C:/temp, launch=//lab/share/ws/src/composiv_tryouts/launch/composiv_tryout.launch" in built
    path = {"ROS_PACKAGE_PATH": r"C:\nowhere;\\lab\share\ws\src"}
    shown = output_of(
        r"cmd|/c|rospack find composiv_tryouts && rosmsg show composiv_tryouts/BatteryLevel", **path
    )
    assert shown.splitlines()[:2] == [r"\\lab\share\ws\src\composiv_tryouts", "string battery"]


@pytest.fixture
def long_folder(environment: None) -> Path:
    shutil.rmtree(DRIVE / "temp" / "long", ignore_errors=True)
    folder = DRIVE.joinpath("temp", "long", *["a folder whose name has 40 characters .a"] * 6)
    folder.mkdir(parents=True)
    return folder


def test_paths_of_workspaces_caches_and_logs_may_be_long(long_folder: Path, workspace: None) -> None:
    long = windows.windows_path(long_folder)
    shutil.copytree(EXAMPLES / "composiv_tryouts", long_folder / "src" / "composiv_tryouts")
    output_of(f"catkin_make|-C|{long}")
    shown = output_of(
        "rosmsg|show|composiv_tryouts/BatteryLevel", ROS_PACKAGE_PATH=rf"{long}\src", ROS_HOME=long
    )
    assert shown.startswith("string battery")
    # Wine's realpath has a limit that Windows lacks, so that the launch file is in a short folder.
    variables = {"ROS_PACKAGE_PATH": r"C:\ws\src", "ROS_LOG_DIR": long, "ROS_HOME": rf"{long}\home"}
    said = output_of("roslaunch|composiv_tryouts|composiv_tryout.launch", code=1, **variables)
    assert rf"{long}\home: Windows starts no program" in said
    assert list(long_folder.glob("**/roslaunch*.log"))


_NAMES = r"""
from pipros_tools.cli import rosbag, rosmsg, rosrun
for name in ("composiv_tryouts/batterylevel", "STD_MSGS/String", "std_msgs/string", "std_msgs/NUL"):
    print(rosmsg.main(["show", name]))
rosrun.main(["x", "y"])
rosbag.main(["record", "-O", r"C:\temp\con.bag", "/a"])
"""


def test_names_have_a_case_and_devices_are_not_files(workspace: None) -> None:
    command = f"python|-c|{_NAMES}"
    said = output_of(command, code=2, ROS_PACKAGE_PATH=r"C:\ws\src;C:\temp\a:D:\b")
    for name in ("composiv_tryouts/batterylevel", "STD_MSGS/String", "std_msgs/string", "std_msgs/NUL"):
        assert f"Unable to load msg [{name}]" in said
    assert said.count("\n1\n") == 4
    assert "on Windows, separate its folders with a semicolon" in said
    assert r"C:\temp\con.bag is the name of a device" in said


def test_closing_the_console_ends_all_programs(start: StartOnWindows) -> None:
    launch = start("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    launch.wait_for("Battery level of vehicle")
    launch.close_console()
    launch.wait(20)
    wait_until(lambda: not windows.running(), 10, lambda: f"the end of {windows.running()}")


_CLOSE = r"""
import ctypes, os, sys, threading, time
from pipros_tools.cli.rosbag import main

def close():
    active = f"{sys.argv[1]}.bag.active"
    while not (os.path.exists(active) and os.path.getsize(active) > 4500):
        time.sleep(0.1)
    ctypes.windll.kernelbase.CtrlRoutine(2)  # what Windows runs in a new thread for CTRL_CLOSE_EVENT

threading.Thread(target=close, daemon=True).start()
sys.exit(main(["record", "-O", sys.argv[1], "/numbers"]))
"""


def test_a_recording_is_complete_after_its_console_was_closed(ros, start, long_folder: Path) -> None:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "-r", "10", "/numbers", "std_msgs/Int32", "data: 5")
    record = start("python", "-c", _CLOSE, rf"{windows.windows_path(long_folder)}\closed")
    assert record.wait(60) == 0, record.output
    assert [file.name for file in long_folder.glob("closed*")] == ["closed.bag"]
