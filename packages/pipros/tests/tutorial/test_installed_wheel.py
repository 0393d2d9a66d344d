"""The installed wheel in a fresh virtual environment, without the source tree."""

import importlib.metadata
import os
import re
import subprocess
import sys
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.master.master import Master
from tests.support.environments import REPOSITORY, files_below, source
from tests.support.ports import ClaimedPort
from tests.support.processes import Processes

SHARE = source("pipros/share")

FIND = """
import os, sys, rospkg
packs = rospkg.RosPack()
print([os.path.basename(packs.get_path(name)) for name in ("rospy", "std_msgs", "mine")])
print("mine" in packs.list(), "rospy" in packs.list())
"""
MANIFEST = """<package format="2"><name>mine</name><version>0.0.0</version><description>d</description>
<maintainer email="a@example.com">a</maintainer><license>none</license>
<exec_depend>rospy</exec_depend></package>"""

USES_MESSAGES = """
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from turtlesim.srv import Spawn
import std_msgs.tools
print(getattr(String, "origin", None) or String.__slots__, std_msgs.tools.origin)
"""
"""In the order in which isort sorts imports: `rospy` does not come first."""


def requirements(name: str) -> Iterator[str]:
    """Return the distributions that a distribution requires, without its extras."""
    for line in importlib.metadata.requires(name) or ():
        if "extra ==" not in line and (found := re.match(r"[\w.-]+", line)):
            yield found[0]


def link(name: str, folder: Path) -> None:
    """Link an installed distribution and its requirements into another environment."""
    try:
        files = importlib.metadata.files(name)
    except importlib.metadata.PackageNotFoundError:
        return  # for another Python or system
    for top in {file.parts[0] for file in files or () if ".." not in file.parts}:
        place = folder / top
        if not place.exists():
            place.symlink_to(Path(str(importlib.metadata.distribution(name).locate_file(top))))
    for needed in requirements(name):
        link(needed, folder)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=REPOSITORY, check=True, capture_output=True)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of programs of an environment with the wheel installed."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder, with_pip=False, symlinks=True)
    programs = folder / "bin"
    command = [sys.executable, "-m", "pip", "--python", str(programs / "python"), "install", "--quiet"]
    offline = ["--no-deps", "--no-index", "--disable-pip-version-check", "--no-compile"]
    subprocess.run([*command, *offline, str(wheel)], check=True)
    (site,) = folder.glob("lib/python*/site-packages")
    for needed in requirements("pipros"):
        link(needed, site)
    return programs


@pytest.fixture
def shell(installed: Path, tmp_path: Path) -> Iterator[Processes]:
    """A shell in that environment, with only the user's workspace on the package path."""
    workspace = tmp_path / "src"
    (workspace / "mine").mkdir(parents=True)
    (workspace / "mine" / "package.xml").write_text(MANIFEST)
    find = workspace / "mine" / "find.py"
    find.write_text(f"#!/usr/bin/env python3\n{FIND}")
    find.chmod(0o755)
    port = ClaimedPort()
    environment = {
        "PATH": f"{installed}{os.pathsep}/usr/bin{os.pathsep}/bin", "HOME": str(tmp_path),
        "ROS_PACKAGE_PATH": str(workspace), "ROS_MASTER_URI": f"http://127.0.0.1:{port.number}",
    }  # fmt: skip
    processes = Processes(environment, tmp_path)
    yield processes
    processes.end_all()
    port.release()


FOUND = ["['rospy', 'std_msgs', 'mine']", "True True"]


def test_the_wheel_has_every_file_of_the_packages_that_ship(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    files = list(files_below(SHARE))
    assert [
        str(file) for file in files if f"pipros/share/{file.relative_to(SHARE).as_posix()}" not in names
    ] == []


def test_the_python_modules_of_packages_are_there(shell: Processes) -> None:
    ended = shell.run("python3", "-c", "from sensor_msgs import point_cloud2 as p; print(p.__file__)")
    assert ended.returncode == 0, ended.output
    assert ended.stdout[0].endswith("site-packages/sensor_msgs/point_cloud2.py")


def test_rospkg_finds_the_packages_that_ship_in_plain_python(shell: Processes) -> None:
    assert shell.run("python3", "-c", FIND).stdout == FOUND
    alone = shell.run(
        "python3", "-c", "import rospkg; print(rospkg.RosPack().get_path('rospy')[-5:])",
        environment={"ROS_PACKAGE_PATH": ""},
    )  # fmt: skip
    assert alone.stdout == ["rospy"], alone.output


def test_rospkg_finds_the_packages_that_ship_in_nodes(shell: Processes, tmp_path: Path) -> None:
    assert shell.run("rosrun", "mine", "find.py").stdout == FOUND
    (tmp_path / "find.launch").write_text(
        '<launch><node name="find" pkg="mine" type="find.py" output="screen" required="true"/></launch>'
    )
    with Master(port=int(shell.environment["ROS_MASTER_URI"].rpartition(":")[2])):
        launched = shell.run("roslaunch", "find.launch")
    assert [line for line in launched.stdout if line in FOUND] == FOUND, launched.output


def test_rospkg_finds_the_packages_that_ship_in_tests(shell: Processes, tmp_path: Path) -> None:
    script = tmp_path / "src" / "mine" / "check.py"
    script.write_text(
        "#!/usr/bin/env python3\nimport unittest, rospkg, rosunit\n"
        "class Check(unittest.TestCase):\n    def test_it(self):\n"
        "        self.assertTrue(rospkg.RosPack().get_path('std_msgs').endswith('std_msgs'))\n"
        "rosunit.unitrun('mine', 'check', Check)\n"
    )
    script.chmod(0o755)
    (script.parent / "check.test").write_text(
        '<launch><test test-name="check" pkg="mine" type="check.py"/></launch>'
    )
    ended = shell.run("rostest", "mine", "check.test", timeout_s=60.0)
    assert ended.returncode == 0, ended.output


def test_tools_are_programs_of_their_packages(shell: Processes, tmp_path: Path) -> None:
    for package in ("rostopic", "rosservice", "rosgraph", "rosnode", "rosparam", "rosmsg", "rosout"):
        assert shell.run("rospack", "find", package).returncode == 0
    usage = shell.run("rosrun", "rostopic", "rostopic").stdout
    assert usage[0] == "rostopic is a command-line tool for printing information about ROS Topics."
    (tmp_path / "talk.launch").write_text(
        '<launch><node name="talker" pkg="rostopic" type="rostopic" '
        "args=\"pub -r 20 /chatter std_msgs/String 'data: hello'\"/></launch>"
    )
    launch = shell.start(
        "roslaunch", "-p", shell.environment["ROS_MASTER_URI"].rpartition(":")[2], "talk.launch"
    )
    launch.wait_for("process.*started")
    assert shell.run("rostopic", "echo", "-n", "1", "/chatter").stdout[0] == 'data: "hello"'
    launch.press_ctrl_c(code=0)


def test_turtles_and_the_tools_of_tf_need_no_numpy(shell: Processes) -> None:
    assert "No module named 'numpy'" in shell.run("python3", "-c", "import numpy").output
    with Master(port=int(shell.environment["ROS_MASTER_URI"].rpartition(":")[2])):
        shell.start("rosrun", "turtlesim", "turtlesim_node", "_headless:=true")
        shell.start("rosrun", "turtle_tf", "turtle_tf_broadcaster.py", "_turtle:=turtle1")
        shell.start("rosrun", "turtle_tf2", "fixed_tf2_broadcaster.py")
        place = r"- Translation: \[5\.544, 5\.544, 0\.000\]"
        shell.start("rosrun", "tf", "tf_echo", "world", "turtle1").wait_for(place)
        shell.start("rosrun", "tf2_tools", "echo.py", "world", "carrot1").wait_for("Translation")
        shell.start("rosrun", "tf", "tf_monitor").wait_for("Frame: turtle1 published by")


@pytest.fixture(params=["wheel", "editable", "target", "zip"])
def without_hook(
    request: pytest.FixtureRequest, installed: Path, wheel: Path, tmp_path: Path
) -> tuple[list[str], str]:
    """A command for Python, and its PYTHONPATH, where no `.pth` file is read except in an installation."""
    if request.param == "wheel":
        return [str(installed / "python")], ""
    if request.param == "editable":
        return [sys.executable], ""
    modules = tmp_path / "modules"
    modules.mkdir()
    for needed in requirements("pipros"):
        link(needed, modules)
    if request.param == "target":
        zipfile.ZipFile(wheel).extractall(modules)
        return [sys.executable, "-S"], str(modules)
    return [sys.executable, "-S"], f"{wheel}{os.pathsep}{modules}"


def imported_messages(command: list[str], path: str, folder: Path, **variables: str) -> str:
    """Return what `USES_MESSAGES` prints, or the last line of its error."""
    environment = {"HOME": str(folder), "PATH": os.environ["PATH"], "PYTHONPATH": path, **variables}
    ended = subprocess.run(
        [*command, "-c", USES_MESSAGES], cwd=folder, env=environment, capture_output=True, text=True
    )
    return ended.stdout.strip() or ended.stderr.strip().splitlines()[-1]


def test_messages_are_imported_where_pipros_is(without_hook: tuple[list[str], str], tmp_path: Path) -> None:
    command, path = without_hook
    found = imported_messages(command, path, tmp_path)
    assert found == "ModuleNotFoundError: No module named 'std_msgs.tools'"

    # A workspace's package of the same name comes first, with its definitions and its modules.
    package = tmp_path / "src" / "std_msgs"
    for name, text in {
        "package.xml": MANIFEST.replace("mine", "std_msgs"),
        "msg/String.msg": "string data\nint32 more\n",
        "msg/Header.msg": "uint32 seq\ntime stamp\nstring frame_id\n",
        "src/std_msgs/__init__.py": "",
        "src/std_msgs/tools.py": "origin = 'workspace'\n",
    }.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    found = imported_messages(command, path, tmp_path, ROS_PACKAGE_PATH=str(package.parent))
    assert found == "['data', 'more'] workspace"

    # So does that of a ROS 2 whose setup file was sourced.
    ros2 = tmp_path / "ros2"
    for name, text in {
        "std_msgs/__init__.py": "",
        "std_msgs/libstd_msgs__rosidl_typesupport_c.so": "",
        "std_msgs/tools.py": "origin = 'ROS 2'\n",
        "std_msgs/msg/__init__.py": "class String:\n    origin = 'rosidl'\n",
    }.items():
        (ros2 / name).parent.mkdir(parents=True, exist_ok=True)
        (ros2 / name).write_text(text)
    first = f"{ros2}{os.pathsep}{path}"
    found = imported_messages(command, first, tmp_path, AMENT_PREFIX_PATH=str(ros2))
    assert found == "rosidl ROS 2"
