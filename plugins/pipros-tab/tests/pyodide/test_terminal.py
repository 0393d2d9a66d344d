"""The case study in terminals whose programs run in Pyodide."""

from pathlib import Path
from typing import Final

import pytest

from tests.pyodide.conftest import pyodide_files  # noqa: F401 # a fixture
from tests.support.environments import REPOSITORY
from tests.support.pyodide_tab import STARTED_WITHIN_S, PyodideTab, PyodideTerminal
from tests.support.waiting import wait_until

EXAMPLE: Final = REPOSITORY / "examples/catkin_ws/src/composiv_tryouts"
WORKSPACE: Final = "feature/buse_nur_emir_07042023/catkin_ws"

CMAKE_CHANGES: Final = {
    "  rospy\n)": "  rospy\n  message_generation\n)",
    "# add_message_files(": "add_message_files(FILES BatteryLevel.msg)\n# add_message_files(",
    "# generate_messages(": "generate_messages()\n# generate_messages(",
    "catkin_package(": "catkin_package(CATKIN_DEPENDS message_runtime",
}
"""Figure 3, as replacements in CMakeLists.txt."""

MANIFEST_CHANGES: Final = {
    "</build_depend>\n": "</build_depend>\n  <build_depend>message_generation</build_depend>\n",
    "</exec_depend>\n": "</exec_depend>\n  <exec_depend>message_runtime</exec_depend>\n",
}
"""Figure 4, as replacements in package.xml."""


pytestmark = pytest.mark.timeout(900)

HOME = "/home/student"
PACKAGE = f"{HOME}/{WORKSPACE}/src/composiv_tryouts"


def edit(tab: PyodideTab, path: str, changes: dict[str, str]) -> None:
    """Change a file of the package, as a student does in the editor."""
    text = tab.read(f"{PACKAGE}/{path}")
    for before, after in changes.items():
        assert before in text, text
        text = text.replace(before, after, 1)
    tab.write(f"{PACKAGE}/{path}", text)


def copy_example(tab: PyodideTab, path: str) -> None:
    tab.write(f"{PACKAGE}/{path}", (EXAMPLE / path).read_text(encoding="utf-8"))


def sourced(tab: PyodideTab) -> PyodideTerminal:
    """Open a terminal, which runs ~/.bashrc, in the folder of the package."""
    terminal = tab.terminal()
    assert terminal.type(f"cd {PACKAGE}") == ""
    return terminal


def test_the_case_study(pyodide_files: Path) -> None:  # noqa: F811
    with PyodideTab(pyodide_files) as tab:
        terminal = tab.terminal()
        make_package(tab, terminal)
        write_nodes(tab, terminal)
        run_nodes(tab, terminal)
        run_tests(tab)


def make_package(tab: PyodideTab, terminal: PyodideTerminal) -> None:
    """Figures 2 to 4."""
    for line in ("mkdir feature", "cd feature", "mkdir buse_nur_emir_07042023"):
        assert terminal.type(line) == ""
    assert terminal.type("ls") == "buse_nur_emir_07042023\n"
    assert terminal.type("cd buse_nur_emir_07042023; mkdir catkin_ws; cd catkin_ws; mkdir src; ls") == "src\n"
    assert "Source space: " in terminal.type("catkin_make")
    assert terminal.type("ls") == "build  devel  src\n"
    created = terminal.type("cd src && catkin_create_pkg composiv_tryouts rospy roscpp")
    assert "Successfully created files in " in created
    terminal.type("cd composiv_tryouts; mkdir msg scripts test launch")
    terminal.type("echo string battery > msg/BatteryLevel.msg")
    assert terminal.type("cat msg/BatteryLevel.msg") == "string battery\n"
    edit(tab, "CMakeLists.txt", CMAKE_CHANGES)
    edit(tab, "package.xml", MANIFEST_CHANGES)
    assert "composiv_tryouts" in terminal.type("cd ../..; catkin_make")
    terminal.type("echo source /opt/ros/noetic/setup.bash > ~/.bashrc")
    terminal.type(f"echo source ~/{WORKSPACE}/devel/setup.bash >> ~/.bashrc; source ~/.bashrc")
    assert terminal.type("rosmsg show BatteryLevel") == "[composiv_tryouts/BatteryLevel]:\nstring battery\n\n"


def write_nodes(tab: PyodideTab, terminal: PyodideTerminal) -> None:
    """Figures 5, 6, 8 and 10."""
    tab.write(
        f"{PACKAGE}/scripts/composiv_talker.py", "#!/usr/bin/env python3\nimport rospy\nrospy.init_node(\n"
    )
    assert "but they're either not files,\n[rosrun] or not executable" in terminal.type(
        "rosrun composiv_tryouts composiv_talker.py"
    )
    terminal.type(f"cd {PACKAGE}; chmod +x scripts/composiv_talker.py")
    failed = terminal.type("rosrun composiv_tryouts composiv_talker.py")
    assert 'composiv_talker.py", line 3' in failed
    assert failed.endswith("SyntaxError: '(' was never closed\n")
    for path in ("scripts/composiv_talker.py", "scripts/composiv_listener.py", "test/test_talker.py"):
        copy_example(tab, path)
    copy_example(tab, "launch/composiv_tryout.launch")
    assert terminal.type("chmod +x scripts/composiv_talker.py scripts/*.py test/*.py") == ""


def run_nodes(tab: PyodideTab, core: PyodideTerminal) -> None:
    """Figures 7 and 1."""
    core.begin("roscore")
    core.wait_for_output("started core service [/rosout]")
    talker, listener = sourced(tab), sourced(tab)
    talker.begin("rosrun composiv_tryouts composiv_talker.py")
    talker.wait_for_output(": %25\n")
    listener.begin("rosrun composiv_tryouts composiv_listener.py")
    listener.wait_for_output(": Battery level of vehicle: %25\n")
    listener.interrupt()
    assert "/talker_node\n" in listener.type("rosnode list")
    assert "Type: composiv_tryouts/BatteryLevel" in listener.type("rostopic info /battery_topic")
    assert listener.type("rostopic echo -n1 /battery_topic") == 'battery: "%25"\n---\n'
    assert "\nOK\n" in listener.type("python3 test/test_talker.py --text")
    listener.begin("rosbag record -O battery /battery_topic --duration 4")
    listener.wait_for_output("Recording to")
    assert "/battery_topic" in listener.type("rosbag info battery.bag")
    talker.interrupt()
    core.interrupt()
    core.wait_for_output(PyodideTerminal.PROMPT)


def run_tests(tab: PyodideTab) -> None:
    """Figure 11: green, then red, because the talker is missing."""
    terminal = sourced(tab)
    green = terminal.type("rostest composiv_tryouts composiv_tryout.launch")
    assert "RESULT: SUCCESS" in green
    edit(
        tab, "launch/composiv_tryout.launch", {'name="talker"/>': 'name="talker" args="chatter" if="false"/>'}
    )
    red = terminal.type("rostest composiv_tryouts composiv_tryout.launch")
    assert "RESULT: FAIL" in red
    assert "FAILURES: 1" in red
    copy_example(tab, "launch/composiv_tryout.launch")
    terminal.begin("roslaunch --screen composiv_tryouts composiv_tryout.launch")
    terminal.wait_for_output("Battery level of vehicle: %25")
    terminal.interrupt()
    terminal.wait_for_output("... shutting down processing monitor complete")


def test_the_turtles_of_the_course_and_twenty_nodes(pyodide_files: Path) -> None:  # noqa: F811
    with PyodideTab(pyodide_files) as tab:
        core, turtles, terminal = tab.terminal(), tab.terminal(), tab.terminal()
        core.begin("roscore")
        core.wait_for_output("started core service [/rosout]")
        turtles.begin("rosrun turtlesim turtlesim_node")
        turtles.wait_for_output("turtlesim: http://localhost:")
        assert terminal.type("rostopic type /turtle1/cmd_vel") == "geometry_msgs/Twist\n"
        terminal.type(
            "rostopic pub -1 /turtle1/cmd_vel geometry_msgs/Twist -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, 1.8]'"
        )
        assert "x: 5.544445" not in terminal.type("rostopic echo -n 1 /turtle1/pose")
        assert terminal.type('rosservice call /spawn 2 2 0.2 ""') == 'name: "turtle2"\n'
        assert terminal.type("rosparam set /turtlesim/background_r 150; rosservice call /clear") == "\n"
        assert terminal.type("rostopic echo -n 1 /turtle2/color_sensor").startswith("r: 150\n")
        turtles.interrupt()

        names = [f"/talker{number}" for number in range(20)]
        nodes = (f'<node pkg="rospy_tutorials" type="talker.py" name="{name[1:]}"/>' for name in names)
        tab.write(f"{HOME}/many.launch", f"<launch>{''.join(nodes)}</launch>")
        turtles.begin("roslaunch many.launch")
        wait_until(lambda: set(names) <= set(terminal.type("rosnode list").split()), STARTED_WITHIN_S)
        assert terminal.type("rostopic info /chatter").count(" * /talker") == len(names)
        turtles.interrupt()
        turtles.wait_for_output("... shutting down processing monitor complete")
