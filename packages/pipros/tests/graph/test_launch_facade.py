"""The Python API of roslaunch in scripts written for Noetic, run one after another in one process."""

import re
import sys

import pytest

from tests.support import documents
from tests.support.processes import Process
from tests.support.programs import make_programs
from tests.support.ros import RosSystem

HEAD = """\
import roslaunch, rospy, sys, traceback
uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
roslaunch.configure_logging(uuid)
def attempt(name, script):
    print("#", name)
    try: exec(script, globals())
    except BaseException: traceback.print_exc(file=sys.stdout)
"""


def start(ros: RosSystem, *words: str) -> Process:
    """Start a script in a system with a package `programs`."""
    programs = {"sleeper": "#!/bin/sh\nexec sleep 1000\n", "fails": "#!/bin/sh\nexit 3\n"}
    folder = make_programs(ros.home / "src" / "programs", programs)
    (folder / "x.launch").write_text(
        '<launch><arg name="n" default="a"/><node pkg="programs" type="sleeper" name="$(arg n)"/></launch>'
    )
    return ros.pipros.start(sys.executable, "-c", *words, ROS_PACKAGE_PATH=str(folder.parent))


SCRIPTS = {
    "a script launches a node and ends it": (
        """
launch = roslaunch.scriptapi.ROSLaunch()
launch.start()
process = launch.launch(roslaunch.core.Node("programs", "sleeper", name="n", namespace="/g"))
print(">", process.is_alive(), process.name)
process.stop()
print(">", process.is_alive())
launch.stop()
""",
        ["> True g/n-N", "> False"],
    ),
    "a script launches files with arguments": (
        """
file = roslaunch.rlutil.resolve_launch_arguments(["programs", "x.launch"])[0]
parent = roslaunch.parent.ROSLaunchParent(uuid, [(file, ["n:=b"])])
parent.start()
print(">", sorted(parent.session.run.running()), parent.spin_once())
parent.shutdown()
""",
        ["> ['b-N'] True"],
    ),
    "listeners are notified of the end of a process": (
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
        ["> n-N 3"],
    ),
    "nodes are monitored and restarted while a script does other work": (
        """
import threading
class Listener(roslaunch.pmon.ProcessListener):
    def process_died(self, name, exit_code):
        print(">", name, exit_code)
        if name.startswith("f-"): died.set()
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
        ["> f-N 3", "> True ['n-N']", "> n-N -2", "> False True"],
    ),
    "a loaded configuration can be changed before it is launched": (
        """
file = roslaunch.rlutil.resolve_launch_arguments(["programs", "x.launch"])[0]
parent = roslaunch.parent.ROSLaunchParent(uuid, [file])
parent._load_config()
parent.config.nodes[0].args = "7"
parent.config.add_param(roslaunch.Param("/added", 5))
parent.start()
process = parent.pm.get_process(parent.config.nodes[0].process_name)
print(">", process.args[1], rospy.get_param("/added"), parent.config.nodes[0].process_name)
parent.shutdown()
""",
        ["> 7 5 a-N"],
    ),
    "a program that does not exist is an exception": (
        """
launch = roslaunch.scriptapi.ROSLaunch()
launch.start()
try:
    launch.launch(roslaunch.core.Node("programs", "nope"))
except roslaunch.RLException as error:
    print(">", str(error).partition(':')[0])
launch.stop()
""",
        ["> failed to launch programs/nope"],
    ),
    "launch files can be read and texts resolved": (
        """
import rospkg
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
try:
    roslaunch.substitution_args.resolve_args("$(find absent)")
except rospkg.ResourceNotFound:
    print("> absent")
""",
        ["> 7 ['/c'] a", "> refused", "> 1-a ['a']", "> absent"],
    ),
}


@pytest.fixture(scope="module")
def printed(module_ros: RosSystem) -> dict[str, list[str]]:
    """What each script prints. The numbers of processes, which increase from script to script, are N."""
    calls = [f"attempt({name!r}, {script!r})\n" for name, (script, _) in SCRIPTS.items()]
    ended = start(module_ros, HEAD + "".join(calls))
    ended.wait()
    parts = [part.splitlines() for part in re.sub(r"(?<=\w)-\d+", "-N", "\n".join(ended.stdout)).split("# ")]
    return {part[0]: part[1:] for part in parts if part}


@pytest.mark.parametrize("rule", SCRIPTS)
def test_a_script_for_noetic_prints_the_same(printed: dict[str, list[str]], rule: str) -> None:
    found = printed[rule]
    assert [line for line in found if line.startswith("> ")] == SCRIPTS[rule][1], found


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


def test_ctrl_c_ends_a_launch_that_spins_and_the_script_continues(ros: RosSystem) -> None:
    running = start(ros, SPIN, "spin")
    running.wait_for(r"started \d+")
    running.press_ctrl_c(code=0)
    assert running.stdout[-1] == "went on True"


def test_the_end_of_a_script_ends_its_nodes(ros: RosSystem) -> None:
    ended = start(ros, SPIN)
    ended.check(0)
    assert ended.stdout[-1] == "[n-2] killing on exit"


def test_the_example_of_the_documentation_runs(ros: RosSystem) -> None:
    text = documents.text_of("guides/launch.md")
    code = text.partition("```python\n")[2].partition("```")[0]
    ended = ros.pipros.run(sys.executable, "-c", code)
    assert ended.returncode == 0, ended.output
    assert "True True True" in ended.stdout
