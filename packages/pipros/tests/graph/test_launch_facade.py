"""The Python API of roslaunch in scripts written for Noetic, each in its own process."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.programs import make_programs
from tests.support.ros import RosSystem

HEAD = """\
import roslaunch, rospy, sys
uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
roslaunch.configure_logging(uuid)
"""


@pytest.fixture
def package(ros: RosSystem) -> Path:
    programs = {"sleeper": "#!/bin/sh\nexec sleep 1000\n", "fails": "#!/bin/sh\nexit 3\n"}
    folder = make_programs(ros.home / "src" / "programs", programs)
    (folder / "x.launch").write_text(
        '<launch><arg name="n" default="a"/><node pkg="programs" type="sleeper" name="$(arg n)"/></launch>'
    )
    return folder


def run(ros: RosSystem, package: Path, script: str) -> list[str]:
    ended = ros.pipros.run(sys.executable, "-c", HEAD + script, ROS_PACKAGE_PATH=str(package.parent))
    assert ended.returncode == 0, ended.output
    return [line for line in ended.stdout if line.startswith("> ")]


def test_a_script_launches_a_node_and_ends_it(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
launch = roslaunch.scriptapi.ROSLaunch()
launch.start()
process = launch.launch(roslaunch.core.Node("programs", "sleeper", name="n", namespace="/g"))
print(">", process.is_alive(), process.name)
process.stop()
print(">", process.is_alive())
launch.stop()
""",
    ) == ["> True g/n-2", "> False"]


def test_a_script_launches_files_with_arguments(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
file = roslaunch.rlutil.resolve_launch_arguments(["programs", "x.launch"])[0]
parent = roslaunch.parent.ROSLaunchParent(uuid, [(file, ["n:=b"])])
parent.start()
print(">", sorted(parent.session.run.running()), parent.spin_once())
parent.shutdown()
""",
    ) == ["> ['b-2'] True"]


def test_listeners_are_notified_of_the_end_of_a_process(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
class Listener(roslaunch.pmon.ProcessListener):
    def process_died(self, name, exit_code):
        print(">", name, exit_code)
        parent.session.request_stop()
parent = roslaunch.parent.ROSLaunchParent(uuid, [], process_listeners=[Listener()], roslaunch_strs=[
    '<launch><node pkg="programs" type="fails" name="n"/></launch>'])
parent.start()
parent.spin()
""",
    ) == ["> n-2 3"]


def test_nodes_are_monitored_and_restarted_while_a_script_does_other_work(
    ros: RosSystem, package: Path
) -> None:
    assert run(
        ros,
        package,
        """
import threading
class Listener(roslaunch.pmon.ProcessListener):
    def process_died(self, name, exit_code):
        print(">", name, exit_code)
        if name == "f-3": died.set()
died = threading.Event()
parent = roslaunch.parent.ROSLaunchParent(uuid, [], process_listeners=[Listener()])
parent.start(auto_terminate=False)
process, _ = parent.runner.launch_node(roslaunch.core.Node("programs", "sleeper", "n", respawn=True))
parent.runner.launch_node(roslaunch.core.Node("programs", "fails", "f"))
print(">", died.wait(30), parent.pm.get_active_names())
process.stop()
again = threading.Event()
while not (process.spawn_count == 2 and process.is_alive()): again.wait(0.01)
parent.shutdown()
print(">", process.is_alive(), parent.pm.done)
""",
    ) == ["> f-3 3", "> True ['n-2']", "> n-2 -2", "> False True"]


def test_a_loaded_configuration_can_be_changed_before_it_is_launched(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
file = roslaunch.rlutil.resolve_launch_arguments(["programs", "x.launch"])[0]
parent = roslaunch.parent.ROSLaunchParent(uuid, [file])
parent._load_config()
parent.config.nodes[0].args = "7"
parent.config.add_param(roslaunch.Param("/added", 5))
parent.start()
process = parent.pm.get_process("a-2")
print(">", process.args[1], rospy.get_param("/added"), parent.config.nodes[0].process_name)
parent.shutdown()
""",
    ) == ["> 7 5 a-2"]


def test_a_program_that_does_not_exist_is_an_exception(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
launch = roslaunch.scriptapi.ROSLaunch()
launch.start()
try:
    launch.launch(roslaunch.core.Node("programs", "nope"))
except roslaunch.RLException as error:
    print(">", str(error).partition(':')[0])
launch.stop()
""",
    ) == ["> failed to launch programs/nope"]


def test_launch_files_can_be_read_and_texts_resolved(ros: RosSystem, package: Path) -> None:
    assert run(
        ros,
        package,
        """
config = roslaunch.ROSLaunchConfig()
text = '<launch><param name="p" value="7"/><node pkg="a" type="b" name="c"/></launch>'
roslaunch.XmlLoader().load_string(text, config)
print(">", config.params["/p"].value, config.resolved_node_names, config.nodes[0].package)
try:
    roslaunch.config.load_config_default(["/nope.launch"], None)
except roslaunch.RLException:
    print("> refused")
context = {"arg": {"x": "1"}}
print(">", roslaunch.substitution_args.resolve_args("$(arg x)-$(anon a)", context)[:3], list(context["anon"]))
""",
    ) == ["> 7 ['/c'] a", "> refused", "> 1-a ['a']"]


SPIN = """
import roslaunch, signal, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in a background job of a shell script
uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
parent = roslaunch.parent.ROSLaunchParent(uuid, [], roslaunch_strs=[
    '<launch><node pkg="programs" type="sleeper" name="n" respawn="true"/></launch>'])
parent.start()
def tell():
    print("started", parent.pm.get_process("n-2").pid, flush=True)
if "spin" in sys.argv:
    wait = parent.pm.mainthread_spin
    parent.pm.mainthread_spin = lambda: (tell(), wait())  # from then on Ctrl-C ends the spinning
    parent.spin()
else:
    tell()
if "spin" in sys.argv:
    print("went on", parent.pm.done)
"""


def test_ctrl_c_ends_a_launch_that_spins_and_the_script_continues(ros: RosSystem, package: Path) -> None:
    running = ros.pipros.start(sys.executable, "-c", SPIN, "spin", ROS_PACKAGE_PATH=str(package.parent))
    running.wait_for(r"started \d+")
    running.press_ctrl_c()
    assert running.wait() == 0, running.output
    assert running.stdout[-1] == "went on True"


def test_the_end_of_a_script_ends_its_nodes(ros: RosSystem, package: Path) -> None:
    ended = ros.pipros.run(sys.executable, "-c", SPIN, ROS_PACKAGE_PATH=str(package.parent))
    assert ended.returncode == 0, ended.output
    assert ended.stdout[-1] == "[n-2] killing on exit"


def test_the_example_of_the_documentation_runs(ros: RosSystem) -> None:
    text = documents.text_of("guides/launch.md")
    code = text.partition("```python\n")[2].partition("```")[0]
    ended = ros.pipros.run(sys.executable, "-c", code)
    assert ended.returncode == 0, ended.output
    assert "True True True" in ended.stdout
