"""A file of a package that is none: an error names package and file, soon, and other packages are built."""

from pathlib import Path

import pytest

from tests.support.ros import RosSystem
from tests.support.unusable_files import make_unusable

KINDS = ("pipe", "endless", "folder", "circle", "huge")
MANIFEST = """<package format="2"><name>{0}</name><version>0.0.1</version><description>x</description>
<maintainer email="a@example.org">x</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend></package>"""
CMAKE = """cmake_minimum_required(VERSION 3.0)
project({0})
find_package(catkin REQUIRED COMPONENTS message_generation actionlib_msgs dynamic_reconfigure)
"""
MESSAGES = "generate_messages(DEPENDENCIES actionlib_msgs)\ncatkin_package()\n"
FILES = {
    "package.xml": "", "CMakeLists.txt": "", "setup.py": "catkin_python_setup()\ncatkin_package()\n",
    "msg/A.msg": f"add_message_files(FILES A.msg)\n{MESSAGES}",
    "srv/A.srv": f"add_service_files(FILES A.srv)\n{MESSAGES}",
    "action/A.action": f"add_action_files(FILES A.action)\n{MESSAGES}",
    "cfg/A.cfg": "generate_dynamic_reconfigure_options(cfg/A.cfg)\ncatkin_package()\n",
    "scripts/node": "catkin_package()\ncatkin_install_python(PROGRAMS scripts/node DESTINATION lib)\n",
}  # fmt: skip
"""Files of a package, and the lines of its CMakeLists.txt that use them."""

BUILDS = ("catkin_make install", "pipros wheel -o dist src")


def make_package(folder: Path, name: str, lines: str) -> None:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(MANIFEST.format(name))
    (folder / "CMakeLists.txt").write_text(CMAKE.format(name) + lines)


def make_packages(source: Path, file: str) -> None:
    """Create a package for each kind of an unusable file, and a good one."""
    make_package(source / "good", "good", "catkin_package()\n")
    for kind in KINDS:
        make_package(source / kind, kind, FILES[file])
        bad = source / kind / file
        bad.parent.mkdir(exist_ok=True)
        bad.unlink(missing_ok=True)
        make_unusable(kind, bad)


@pytest.mark.needs("resource limits")
@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("build", BUILDS)
def test_a_build_names_each_file_and_goes_on(build: str, file: str, ros: RosSystem) -> None:
    make_packages(ros.home / "src", file)
    limits = 'ulimit -v 3000000; ulimit -f 100000; exec "$@"'

    built = ros.pipros.run("sh", "-c", limits, "sh", *build.split(), PYTHONDONTWRITEBYTECODE="1")

    built.check(1)
    lines = built.output.splitlines()
    about = {
        kind: ["".join(lines[i : i + 3]) for i, line in enumerate(lines) if kind in line] for kind in KINDS
    }
    if file == "package.xml":
        del about["folder"]  # a folder of that name is no package, in genuine catkin, too
    name = Path(file).name
    assert {kind: lines for kind, lines in about.items() if not any(name in line for line in lines)} == {}
    assert list(ros.home.glob("install/share/good/package.xml")) + list(ros.home.glob("dist/ros1_good-*.whl"))


@pytest.mark.parametrize(("command", "file"), [("rosmsg", "msg/A.msg"), ("rossrv", "srv/A.srv")])
def test_a_definition_is_named(command: str, file: str, ros: RosSystem) -> None:
    make_packages(ros.home / "src", file)
    for kind in KINDS:
        shown = ros.pipros.run(command, "show", f"{kind}/A", ROS_PACKAGE_PATH=str(ros.home / "src"))
        shown.check(1, f"{kind}/A")
        assert len(shown.output.splitlines()) == 1
