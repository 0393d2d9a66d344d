"""rosrun replaces its process with the program; the interpreter that a script names is chosen."""

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import errand
from tests.support.environments import file_of_tests
from tests.support.interpreters import make_interpreter
from tests.support.patrol import PACKAGES, SAID
from tests.support.programs import make_programs
from tests.support.ros import RosSystem

# rosrun replaces its process with the program, including arguments, exit code and signals.


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


def test_the_program_takes_over_arguments_and_exit_code(ros: RosSystem, folder: Path) -> None:
    script(folder, "show", '#!/bin/sh\nfor word; do echo "$word"; done\nexit 7\n')
    ended = ros.pipros.run("rosrun", "programs", "show", "a b", "--debug", "x:=y", "__name:=n")
    assert (ended.returncode, ended.stdout) == (7, ["a b", "--debug", "x:=y", "__name:=n"])


def test_rosrun_is_the_program_afterwards(ros: RosSystem, folder: Path) -> None:
    script(folder, "wait", "#!/bin/sh\necho pid $$\nexec sleep 1000\n")
    running = ros.pipros.start("rosrun", "programs", "wait")
    assert int(running.wait_for(r"pid (\d+)")[1]) == running.pid
    running.send_signal(signal.SIGTERM, code=-signal.SIGTERM)


def test_python_nodes_get_the_python_that_pipros_is_in(ros: RosSystem, folder: Path) -> None:
    script(folder, "which.py", "#!/usr/bin/env python3\nimport sys, rospy\nprint(sys.prefix)\n")
    rosrun = Path(sys.executable).parent / "rosrun"
    ended = ros.pipros.run(rosrun, "programs", "which.py", PATH="/usr/bin:/bin")
    assert ended.stdout == [sys.prefix]


@pytest.mark.parametrize(
    ("content", "complaint", "code"),
    [
        ("import rospy\n", "make '#!/usr/bin/env python3' its first line", 126),
        ("#!/usr/bin/env python3\r\nimport rospy\r\n", "Windows line endings", 127),
        ("#!/no/such/ruby\n", "/no/such/ruby, which does not exist", 127),
    ],
)
def test_a_script_that_cannot_start_is_explained(ros, folder, content, complaint: str, code: int) -> None:
    script(folder, "bad.py", content)
    ended = ros.pipros.run("rosrun", "programs", "bad.py")
    ended.check(code, complaint)


def test_a_missing_prefix_command_ends_with_127(ros: RosSystem, folder: Path) -> None:
    script(folder, "show", "#!/bin/sh\n")
    ended = ros.pipros.run("rosrun", "--prefix", "no_such_debugger", "programs", "show")
    ended.check(127, "no_such_debugger")


def test_the_answer_selects_one_of_several(ros: RosSystem, folder: Path) -> None:
    for place in ("a", "b"):
        (folder / place).mkdir()
        script(folder / place, "show", f"#!/bin/sh\necho from {place}\n")
    ended = subprocess.run(
        ["rosrun", "programs", "show"], input="2\n", env=ros.pipros.environment, text=True,
        capture_output=True, check=False,
    )  # fmt: skip
    assert (ended.returncode, ended.stdout.splitlines()[-1]) == (0, "from b")


def test_the_logs_of_a_run_are_found_by_a_program_of_roslaunch(ros: RosSystem) -> None:
    ended = ros.pipros.run("rosrun", "roslaunch", "roslaunch-logs")
    assert (ended.returncode, ended.stderr) == (2, ["No active roscore"])


@pytest.mark.parametrize("tool", [
    "rosbag", "rosclean", "roslaunch", "roslaunch-check", "roslaunch-deps", "rosmsg", "rosnode", "rosparam",
    "rosservice", "rostest", "rostopic", "rosunit", "roswtf",
])  # fmt: skip
def test_every_tool_is_a_program_of_its_package(ros: RosSystem, tool: str) -> None:
    ended = ros.pipros.run("rosrun", tool.partition("-")[0], tool, "-h")
    assert tool in ended.output
    assert ended.returncode == 0 or (ended.returncode == 64 and not tool.startswith("roslaunch"))


def test_a_script_for_python_2_is_named_with_its_remedy(ros: RosSystem) -> None:
    scripts = ros.home / "src" / "old" / "scripts"
    scripts.mkdir(parents=True)
    (scripts.parent / "package.xml").write_text("<package><name>old</name></package>")
    script = scripts / "talker.py"
    script.write_text("#!/usr/bin/env python3\nprint 'hello'\n")
    script.chmod(0o755)
    (scripts.parent / "old.launch").write_text('<launch><node pkg="old" type="talker.py" name="t"/></launch>')
    path = str(ros.home / "src")
    ended = ros.pipros.run("rosrun", "old", "talker.py", ROS_PACKAGE_PATH=path)
    ended.check(1, f"[rosrun] {script}:2 is Python 2, and Noetic runs Python 3: ")
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", "old", "old.launch", ROS_PACKAGE_PATH=path)
    launched.wait_for(r"\[t-1\] .*talker.py:2 is Python 2.*python -m fissix -w ")


# Scripts that name an interpreter, such as `#!/usr/bin/python3`, run by rosrun, roslaunch and rostest.


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
def test_rosrun_starts_scripts_whose_python_lacks_rospy(ros: RosSystem, folder: Path, named: str) -> None:
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
    ended.check(3, "not executable")
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
    ended.check(126, "PIPROS_INTERPRETER must be own or script, got [both]")


def test_the_doctor_names_the_interpreter_of_a_node(ros: RosSystem, folder: Path) -> None:
    show = script(folder, "show.py", f"#!/no/such/python\n{SHOW}")
    found = ros.pipros.run("pipros", "doctor", str(show))
    reason = "/no/such/python, which its first line names, does not exist"
    assert found.stdout == [f"{show} is started with {sys.executable}, because {reason}."]
    assert found.returncode == 0
    found = ros.pipros.run("pipros", "doctor", str(folder / "absent.py"))
    assert (found.returncode, found.stdout) == (1, [f"{folder / 'absent.py'} is not a file."])


# Packages written for Noetic from the public description of its libraries run unchanged.


def test_a_robot_with_actions_and_transforms_patrols(ros: RosSystem) -> None:
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(PACKAGES)

    launched = ros.pipros.run(
        "roslaunch", "patrol", "patrol.launch", "-p", str(ros.port), "--screen", timeout_s=120
    )

    found = [line.partition("] ")[2] if line.startswith("[patrol-") else line for line in launched.stdout]
    assert [line for line in found if line in SAID] == SAID, launched.output


def test_a_state_machine_runs_an_errand(ros: RosSystem) -> None:
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(PACKAGES)

    launched = ros.pipros.run(
        "roslaunch", "state_machines", "errand.launch", "-p", str(ros.port), "--screen", timeout_s=120
    )

    assert [line for line in launched.stdout if line in errand.SAID] == errand.SAID, launched.output
