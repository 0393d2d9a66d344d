"""ROS packages that pip itself builds and installs, in new environments that have no index."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

from tests.support import documents
from tests.support.environments import EXAMPLES
from tests.support.ports import ClaimedPort
from tests.support.wheels import Installed, build_pipros, repack_requirements

pytestmark = pytest.mark.timeout(600)  # pip writes the 2,600 files of pipros twice

CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(my_robot_msgs)
find_package(catkin REQUIRED COMPONENTS message_generation std_msgs)
catkin_python_setup()
add_message_files(FILES State.msg)
generate_messages(DEPENDENCIES std_msgs)
catkin_package()
catkin_install_python(PROGRAMS scripts/show DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
install(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
"""
FILES = {
    "package.xml": """<package format="3"><name>my_robot_msgs</name><version>1.2.0</version>
<description>d</description><maintainer email="a@example.org">A</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend><depend>std_msgs</depend><exec_depend>rospy</exec_depend>
</package>""",
    "CMakeLists.txt": CMAKE,
    "setup.py": "from distutils.core import setup\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
    "setup(**generate_distutils_setup(packages=['robot_lib'], package_dir={'': 'src'}))\n",
    "src/robot_lib/__init__.py": "WHO = 'first'\n",
    "msg/State.msg": "std_msgs/Header header\nint8 first\n",
    "scripts/show": "#!/usr/bin/env python\nimport robot_lib\nfrom my_robot_msgs.msg import State\n"
    "print(robot_lib.WHO, State.__slots__)\n",
    "launch/show.launch": '<launch><node pkg="my_robot_msgs" type="show" name="show" output="screen" '
    'required="true"/></launch>\n',
}
SHOWN = "first ['header', 'first']"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheels of pipros and of what it requires."""
    folder = tmp_path_factory.mktemp("wheels")
    build_pipros(folder)
    repack_requirements("pipros", folder)
    return folder


@pytest.fixture(scope="module")
def installed(wheels: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """A new environment with pipros."""
    made = Installed(tmp_path_factory.mktemp("environment"), wheels, tmp_path_factory.mktemp("home"))
    made.pip("install", "--quiet", "pipros-wheels")
    return made


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "my_robot_msgs"
    for path, text in FILES.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    (folder / "scripts" / "show").chmod(0o755)
    return folder


def test_pip_installs_a_package_and_uninstalls_every_file(installed: Installed, package: Path) -> None:
    before = installed.files()
    installed.run("pipros", "wheel", "--init", package)
    installed.pip("install", "--quiet", package)
    assert installed.run("rospack", "find", "my_robot_msgs").strip() == str(
        installed.folder / "share" / "my_robot_msgs"
    )
    assert installed.run("rosrun", "my_robot_msgs", "show").strip() == SHOWN
    port = ClaimedPort()
    shown = installed.run("roslaunch", "my_robot_msgs", "show.launch", ROS_MASTER_URI=port.uri)
    port.release()
    assert SHOWN in shown
    assert installed.run("python", "-c", "import robot_lib; print(robot_lib.WHO)").strip() == "first"
    assert "my_robot_msgs/State" in installed.run("rosmsg", "package", "my_robot_msgs")
    installed.pip("uninstall", "--quiet", "--yes", "ros1-my-robot-msgs")
    assert installed.files() == before


def test_an_editable_installation_shows_changes_at_once(installed: Installed, package: Path) -> None:
    before = installed.files()
    installed.run("pipros", "wheel", "--init", package)
    installed.pip("install", "--quiet", "--no-build-isolation", "--editable", package)
    assert installed.run("rosrun", "my_robot_msgs", "show").strip() == SHOWN
    (package / "msg" / "State.msg").write_text("int8 second\n")
    (package / "src" / "robot_lib" / "__init__.py").write_text("WHO = 'second'\n")
    script = package / "scripts" / "show"
    script.write_text(script.read_text() + "print('third')\n")
    assert installed.run("rosrun", "my_robot_msgs", "show").split("\n")[:2] == ["second ['second']", "third"]
    installed.pip("uninstall", "--quiet", "--yes", "ros1-my-robot-msgs")
    assert installed.files() == before


def test_a_target_folder_is_found_on_the_python_path(installed: Installed, package: Path, tmp_path) -> None:
    installed.run("pipros", "wheel", package, "-o", tmp_path / "dist")
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    installed.pip("install", "--quiet", "--no-deps", "--target", tmp_path / "target", wheel)
    # pip leaves out lib/, so that only programs in share/ remain
    code = "import robot_lib; from my_robot_msgs.msg import State; print(robot_lib.WHO, State.__slots__)"
    target = str(tmp_path / "target")
    assert installed.run("python", "-c", code, PYTHONPATH=target).strip() == SHOWN
    nodes = installed.run("roslaunch", "--nodes", "my_robot_msgs", "show.launch", PYTHONPATH=target)
    assert "/show" in nodes


def test_without_a_wheel_of_pipros_the_advice_says_what_is_needed(
    installed: Installed, package: Path, tmp_path: Path
) -> None:
    advice = installed.run("pipros", "wheel", "--init", package)
    assert "PIP_FIND_LINKS=FOLDER pip install ." in advice
    output = installed.pip("install", package, code=1, PIP_FIND_LINKS=str(tmp_path))
    assert "No matching distribution found for pipros" in output


GUIDE = documents.text_of("guides/pip.md")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", GUIDE, re.DOTALL | re.MULTILINE)


@contextmanager
def served(folder: Path) -> Iterator[int]:
    """Serve a folder, as `python -m http.server` does, and yield the port."""
    handler = partial(SilentHandler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join()


class SilentHandler(SimpleHTTPRequestHandler):
    def log_message(self, *_arguments: object) -> None:
        """Print nothing."""


def test_the_commands_of_the_guide_install_forty_packages(installed: Installed, tmp_path: Path) -> None:
    before = installed.files()
    (tmp_path / "make_lab.py").write_text(blocks("python")[0])
    (tmp_path / "wheels").mkdir()
    build, *ways = blocks("bash")
    run = partial(installed.shell, folder=tmp_path)
    run(build)  # `pip download` finds pipros in the folder that the variables name
    assert len(list((tmp_path / "wheels").glob("ros1_lab_*.whl"))) == 40
    with served(tmp_path / "wheels") as port:
        for way in ways:
            shown = run(
                way.replace("lab.example:8000", f"127.0.0.1:{port}").replace("lab.example", "127.0.0.1"),
                is_bare=True,
            )
            assert "/lab_robot" in shown or "roslaunch" not in way
            assert installed.run("rospack", "find", "lab_robot").strip().startswith(str(installed.folder))
            installed.pip("uninstall", "--quiet", "--yes", "ros1-lab-robot")
    assert installed.run("rosmsg", "show", "lab_part39/State") == "int8 level\n\n"
    installed.pip("uninstall", "--quiet", "--yes", *(f"ros1-lab-part{number}" for number in range(1, 40)))
    assert installed.files() == before


def test_a_higher_version_on_another_index_is_not_taken(
    installed: Installed, package: Path, tmp_path: Path
) -> None:
    folders = {}
    for name, version in (("own", "1.2.0"), ("other", "99.0.0")):
        manifest = package / "package.xml"
        manifest.write_text(manifest.read_text().replace("1.2.0", version))
        folders[name] = tmp_path / name
        installed.run("pipros", "wheel", package, "-o", folders[name])
        installed.run("pipros", "index", folders[name])
    own, other = (f"file://{folder}/simple/" for folder in folders.values())
    download = partial(installed.shell, folder=tmp_path, is_bare=True)
    words = "pip download --quiet --no-deps --dest"
    download(f"{words} safe --index-url {own} ros1-my-robot-msgs")
    lock = folders["own"] / "requirements.lock"
    download(f"{words} locked --index-url {own} --extra-index-url {other} --require-hashes -r {lock}")
    download(f"{words} unsafe --index-url {own} --extra-index-url {other} ros1-my-robot-msgs")
    found = {
        name: [file.name.split("-")[1] for file in (tmp_path / name).iterdir()]
        for name in ("safe", "locked", "unsafe")
    }
    assert found == {"safe": ["1.2.0"], "locked": ["1.2.0"], "unsafe": ["99.0.0"]}


def test_pipros_install_resolves_builds_and_installs(installed: Installed, package: Path, tmp_path) -> None:
    before = installed.files()
    user = tmp_path / "user"
    user.mkdir()
    (user / "package.xml").write_text(
        FILES["package.xml"].replace("my_robot_msgs", "user").replace("std_msgs", "my_robot_msgs")
    )
    (user / "CMakeLists.txt").write_text("project(user)\nfind_package(catkin)\ncatkin_package()\n")
    installed.run("pipros", "wheel", package, "-o", tmp_path / "wheels")
    plan = installed.shell(f"pipros install --dry-run --find-links wheels {user}", folder=tmp_path)
    assert re.search(r"my_robot_msgs +wheel in a folder +ros1-my-robot-msgs==1.2.0 +user", plan)
    assert installed.files() == before
    installed.shell(f"pipros install --find-links wheels {user}", folder=tmp_path)
    assert sorted(installed.run("rospack", "depends1", "user").split()) == ["my_robot_msgs", "rospy"]
    (user / "launch").mkdir()
    (user / "launch" / "new.launch").write_text("<launch/>")  # of the same version
    installed.shell(f"pipros install --find-links wheels {user}", folder=tmp_path)
    assert (installed.folder / "share" / "user" / "launch" / "new.launch").is_file()
    installed.pip("uninstall", "--quiet", "--yes", "ros1-my-robot-msgs", "ros1-user")
    assert installed.files() == before


def test_the_case_study_runs_from_wheels(installed: Installed, tmp_path: Path) -> None:
    before = installed.files()
    installed.run("pipros", "wheel", EXAMPLES, "-o", tmp_path)
    installed.pip("install", "--quiet", *tmp_path.glob("*.whl"))
    code = (
        "from composiv_tryouts.msg import BatteryLevel; from vehicle_battery.cfg import MonitorConfig as c; "
    )
    assert (
        installed.run("python", "-c", f"{code}print(c.__name__)").strip()
        == "vehicle_battery.cfg.MonitorConfig"
    )
    nodes = installed.run("roslaunch", "--nodes", "composiv_tryouts", "composiv_tryout.launch")
    assert len(nodes.split()) > 1
    assert "/battery_monitor" in installed.run("roslaunch", "--nodes", "vehicle_battery", "battery.launch")
    installed.pip("uninstall", "--quiet", "--yes", "ros1-composiv-tryouts", "ros1-vehicle-battery")
    assert installed.files() == before
