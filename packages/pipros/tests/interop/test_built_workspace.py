"""A workspace that genuine catkin built, used from pipros: C++ nodes beside Python ones."""

from __future__ import annotations

import pytest

from tests.support.catkin import CatkinWorkspace
from tests.support.ros import RosSystem

LAUNCH = """
<launch>
  <node pkg="cpp_battery" type="battery_talker" name="talker" ns="robot"/>
  <node pkg="cpp_battery" type="battery_listener" name="listener" ns="robot" output="screen"/>
  <node pkg="composiv_tryouts" type="composiv_listener.py" name="python_listener" ns="robot" output="screen"/>
</launch>
"""


@pytest.fixture
def sourced(ros: RosSystem, catkin_workspace: CatkinWorkspace) -> RosSystem:
    """Return the variables after `source devel/setup.bash` in the environment of pipros."""
    for name in ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH"):
        ros.pipros.environment[name] = catkin_workspace.variables[name]
    return ros


def test_rosrun_finds_and_starts_a_cpp_node(sourced: RosSystem) -> None:
    sourced.pipros.start_master()
    sourced.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")

    heard = sourced.pipros.start("rosrun", "cpp_battery", "battery_listener")

    heard.wait_for(r"^heard %25 from /talker_node$")


def test_roslaunch_starts_cpp_and_python_nodes_and_ends_both(sourced: RosSystem) -> None:
    file = sourced.home / "both.launch"
    file.write_text(LAUNCH)

    launch = sourced.pipros.start("roslaunch", file)

    launch.wait_for(r"^heard %\d+ from /robot/talker$")
    launch.wait_for(r"Battery level of vehicle: %\d+")
    launch.press_ctrl_c()
    assert launch.wait() == 0


def test_the_generated_modules_of_the_workspace_work_with_our_genpy(
    sourced: RosSystem, catkin_workspace: CatkinWorkspace
) -> None:
    modules = catkin_workspace.folder / "devel/lib/python3/dist-packages"
    asked = (
        "import composiv_tryouts.msg._BatteryLevel as generated, genpy; m = generated.BatteryLevel('%25'); "
        "print(generated.__file__, isinstance(m, genpy.Message), m)"
    )

    ended = sourced.pipros.run("python3", "-c", asked, PYTHONPATH=str(modules))

    file = modules / "composiv_tryouts/msg/_BatteryLevel.py"
    assert ended.stdout == [f'{file} True battery: "%25"'], ended.output
