"""Scripts that name an interpreter, such as `#!/usr/bin/python3`, run by rosrun, roslaunch and rostest."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from tests.support.environments import file_of_tests
from tests.support.interpreters import make_interpreter
from tests.support.programs import make_programs
from tests.support.ros import RosSystem

COURSES = file_of_tests("courses")
REPORT = "charged: True, driven, stopped: True"
SHOW = "import sys, rospy\nprint(sys.prefix)\n"
TEST = """\
#!{interpreter}
import sys, unittest, rospy, rosunit

class Prefix(unittest.TestCase):
    def test_it_is_the_own(self):
        self.assertEqual(sys.prefix, {prefix!r})

rosunit.unitrun("programs", "prefix", Prefix)
"""


@pytest.fixture
def folder(ros: RosSystem) -> Path:
    """A package `programs`, alone on the package path."""
    package = make_programs(ros.home / "programs", {})
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(package)
    return package


def script(folder: Path, name: str, content: str, mode: int = 0o755) -> Path:
    path = folder / name
    path.write_text(content)
    path.chmod(mode)
    return path


def launch(folder: Path, body: str) -> Path:
    path = folder / "it.launch"
    path.write_text(f"<launch>{body}</launch>")
    return path


def test_a_course_with_ten_such_scripts_runs_from_roslaunch(ros: RosSystem) -> None:
    """Scripts whose interpreter has genuine rospy run there, the others with pipros's own interpreter."""
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(COURSES)

    launched = ros.pipros.run("roslaunch", "first_lines", "robot.launch", "-p", str(ros.port), timeout_s=120)

    assert REPORT in launched.stdout, launched.output
    assert "Traceback" not in launched.output


def test_the_course_runs_where_no_interpreter_has_rospy(ros: RosSystem) -> None:
    other = make_interpreter(ros.home / "usr")
    course = shutil.copytree(COURSES / "first_lines", ros.home / "ws" / "first_lines")
    for path in (course / "scripts").iterdir():
        path.write_text(
            path.read_text().replace("/usr/bin/python3", str(other)).replace("/usr/bin", "/no/such")
        )
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(course)

    launched = ros.pipros.run("roslaunch", "first_lines", "robot.launch", "-p", str(ros.port), timeout_s=120)

    assert REPORT in launched.stdout, launched.output
    assert "fake interpreter" not in launched.output


@pytest.mark.parametrize("named", ["usr/bin/python3", "none/python", "none/python3"])
def test_rosrun_starts_a_script_whose_interpreter_has_no_rospy(
    ros: RosSystem, folder: Path, named: str
) -> None:
    make_interpreter(ros.home / "usr")
    script(folder, "show.py", f"#!{ros.home}/{named}\n{SHOW}")
    ended = ros.pipros.run("rosrun", "programs", "show.py")
    assert (ended.returncode, ended.stdout) == (0, [sys.prefix]), ended.output


def test_rosrun_leaves_a_script_to_an_interpreter_with_rospy(ros: RosSystem, folder: Path) -> None:
    other = make_interpreter(ros.home / "usr", rospy_in="lib/python3/dist-packages")
    show = script(folder, "show.py", f"#!{other}\n{SHOW}")
    ended = ros.pipros.run("rosrun", "programs", "show.py", "a", "b")
    assert ended.stdout == [f"fake interpreter {show} a b"]
    ended = ros.pipros.run("rosrun", "programs", "show.py", PIPROS_INTERPRETER="own")
    assert ended.stdout == [sys.prefix]


def test_roslaunch_takes_the_choice_from_the_environment_of_the_node(ros: RosSystem, folder: Path) -> None:
    other = make_interpreter(ros.home / "usr")
    script(folder, "show.py", f"#!{other}\n{SHOW}")
    file = launch(
        folder,
        '<node pkg="programs" type="show.py" name="own" output="screen"/>'
        '<node pkg="programs" type="show.py" name="named" output="screen">'
        '<env name="PIPROS_INTERPRETER" value="script"/></node>',
    )
    launched = ros.pipros.start("roslaunch", str(file), "-p", str(ros.port))
    launched.wait_for(f"^{sys.prefix}$")
    launched.wait_for("^fake interpreter .*__name:=named")


def test_a_parameter_from_such_a_script_is_read(ros: RosSystem, folder: Path) -> None:
    show = script(folder, "show.py", f"#!/no/such/python3\n{SHOW}")
    file = launch(folder, f'<param name="prefix" command="{show} x"/>')
    printed = ros.pipros.run("roslaunch", "--dump-params", str(file))
    assert sys.prefix in printed.output


def test_a_parameter_from_a_script_without_permission_is_refused(ros: RosSystem, folder: Path) -> None:
    show = script(folder, "show.py", f"#!/no/such/python3\n{SHOW}", 0o644)
    file = launch(folder, f'<param name="prefix" command="{show} x"/>')
    printed = ros.pipros.run("roslaunch", "--dump-params", str(file))
    assert "Permission denied" in printed.output


def test_scripts_without_permission_are_not_found_as_in_noetic(ros: RosSystem, folder: Path) -> None:
    script(folder, "show.py", f"#!/no/such/python3\n{SHOW}", 0o644)
    ended = ros.pipros.run("rosrun", "programs", "show.py")
    assert ended.returncode == 3
    assert "not executable" in ended.output
    file = launch(folder, '<node pkg="programs" type="show.py" name="show"/>')
    launched = ros.pipros.start("roslaunch", str(file), "-p", str(ros.port))
    launched.wait_for("permission is set to executable")


def test_rostest_and_rosunit_start_such_a_test(ros: RosSystem, folder: Path) -> None:
    test = script(folder, "prefix.py", TEST.format(interpreter="/no/such/python3", prefix=sys.prefix))
    file = launch(folder, '<test pkg="programs" type="prefix.py" test-name="prefix"/>')
    tested = ros.pipros.run("rostest", str(file), timeout_s=60)
    assert tested.returncode == 0, tested.output
    tested = ros.pipros.run("rosunit", str(test), timeout_s=60)
    assert tested.returncode == 0, tested.output


def test_a_python_2_script_gets_one_line(ros: RosSystem, folder: Path) -> None:
    script(folder, "old.py", "#!/usr/bin/env python2\nprint 'hello'\n")
    ended = ros.pipros.run("rosrun", "programs", "old.py")
    assert ended.returncode == 127
    assert (
        "old.py is a Python 2 script (#!/usr/bin/env python2), and ROS Noetic runs Python 3" in ended.output
    )
    file = launch(folder, '<node pkg="programs" type="old.py" name="old"/>')
    launched = ros.pipros.start("roslaunch", str(file), "-p", str(ros.port))
    launched.wait_for("is a Python 2 script")


def test_an_unknown_choice_of_the_interpreter_is_an_error(ros: RosSystem, folder: Path) -> None:
    script(folder, "show.py", f"#!/usr/bin/env python3\n{SHOW}")
    ended = ros.pipros.run("rosrun", "programs", "show.py", PIPROS_INTERPRETER="both")
    assert ended.returncode == 126
    assert "PIPROS_INTERPRETER must be own or script, got [both]" in ended.output


def test_the_doctor_names_the_interpreter_of_a_node(ros: RosSystem, folder: Path) -> None:
    show = script(folder, "show.py", f"#!/no/such/python\n{SHOW}")
    found = ros.pipros.run("pipros", "doctor", str(show))
    reason = "/no/such/python, which its first line names, does not exist"
    assert found.stdout == [f"{show} is started with {sys.executable}, because {reason}."]
    assert found.returncode == 0
    found = ros.pipros.run("pipros", "doctor", str(folder / "absent.py"))
    assert (found.returncode, found.stdout) == (1, [f"{folder / 'absent.py'} is not a file."])
