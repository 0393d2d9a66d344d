#!/usr/bin/env python3
"""The time that users wait for commands and launches: pipros and genuine ROS, in one run.

    script/bench startup [--rounds 3] [--only rostopic,roslaunch]

Both implementations alternate, each with its own master, and the median counts. If genuine ROS 1 is not
installed, only pipros is measured. Other load affects the figures more than the ratio.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from xmlrpc.client import ServerProxy

import psutil
from worlds import GENUINE_PYTHON, World, compare

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "catkin_ws" / "src"
READY_WITHIN_S = 30.0
MISSED_AFTER_S = 20.0
HELLO = ("std_msgs/String", "data: hello")
VARIABLES = {"ROS_PACKAGE_PATH": str(EXAMPLE), "LANG": "C.UTF-8", "PYTHONUNBUFFERED": "1"}


def started(world, *argv, **variables):
    """Start a command in its own process group; its output is in one pipe."""
    return subprocess.Popen(
        argv,
        env={**world.environment, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def end(process):
    """Send Ctrl-C as a terminal does. Genuine nodes sometimes miss it; they are eventually killed, with their
    children, which have groups of their own and hold the output open.
    """
    os.killpg(process.pid, signal.SIGINT)
    try:
        process.communicate(timeout=MISSED_AFTER_S)
    except subprocess.TimeoutExpired:
        for child in psutil.Process(process.pid).children(recursive=True):
            child.kill()
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def run(world, *argv):
    """Return the duration in seconds of a command that must succeed."""
    began = time.perf_counter()
    ended = subprocess.run(argv, env=world.environment, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - began
    if ended.returncode:
        raise SystemExit(f"{world.name}: {' '.join(argv)} failed:\n{ended.stdout}{ended.stderr}")
    return seconds


def run_until(world, line, *argv, **variables):
    """Return the seconds until a line contains `line`, and from Ctrl-C to the end of all processes."""
    began = time.perf_counter()
    process, printed = started(world, *argv, **variables), []
    while line not in "".join(printed[-1:]):
        printed.append(process.stdout.readline())
        if not printed[-1]:
            raise SystemExit(f"{world.name}: {' '.join(argv)} ended without '{line}':\n{''.join(printed)}")
    seen = time.perf_counter()
    end(process)
    return seen - began, time.perf_counter() - seen


@contextlib.contextmanager
def running(world, *argv):
    """Run a command in the background while the block runs."""
    process = started(world, *argv)
    try:
        yield
    finally:
        end(process)


@contextlib.contextmanager
def master(world):
    """Run roscore, and wait for /rosout."""
    deadline = time.monotonic() + READY_WITHIN_S
    with running(world, "roscore", "-p", str(world.port)):
        while True:
            with contextlib.suppress(OSError), ServerProxy(world.environment["ROS_MASTER_URI"]) as proxy:
                if proxy.lookupNode("/benchmark", "/rosout")[0] == 1:
                    break
            if time.monotonic() > deadline:
                raise SystemExit(f"{world.name}: no roscore within {READY_WITHIN_S} s")
            time.sleep(0.02)
        yield


def commands(world, _seconds):
    with master(world):
        run(world, "rosparam", "set", "/rate", "10")
        run(world, "rosparam", "set", "/robot", "{name: r1, wheels: [1.5, 2.5], base: {width: 0.4}}")
        return {
            "rostopic list: s": run(world, "rostopic", "list"),
            "rosnode list: s": run(world, "rosnode", "list"),
            "rosparam get, a number: s": run(world, "rosparam", "get", "/rate"),
            "rosparam get, a string of two lines: s": run(world, "rosparam", "get", "/rosversion"),
            "rosparam get, a dictionary: s": run(world, "rosparam", "get", "/robot"),
            "rosmsg show sensor_msgs/JointState: s": run(world, "rosmsg", "show", "sensor_msgs/JointState"),
        }


def echo(world, _seconds):
    """Publish a latched message in advance, so that only the command's time is measured."""
    with master(world), running(world, "rostopic", "pub", "-l", "/latched", *HELLO):
        # when this command ends, the publisher is available
        run(world, "rostopic", "echo", "-n", "1", "/latched")
        return {"rostopic echo -n 1, latched: s": run(world, "rostopic", "echo", "-n", "1", "/latched")}


def completion(world, _seconds):
    """Complete `rostopic echo /<TAB>` as a shell does; for genuine ROS, with rosbash's function."""
    if world.name == "genuine":
        command = (
            "bash", "-c", "source /usr/share/bash-completion/completions/rosbash; "
            "COMP_WORDS=(rostopic echo /); COMP_CWORD=2; _roscomplete_rostopic; [ ${#COMPREPLY[@]} -gt 0 ]",
        )  # fmt: skip
    else:
        command = ("pipros-complete", "2", "rostopic", "echo", "/")
    with master(world):
        return {"rostopic echo /<TAB>: s": run(world, *command)}


def imports(world, _seconds):
    return {"import rospy: s": run(world, "python3", "-c", "import rospy")}


def core(world, _seconds):
    up, down = run_until(world, "started core service", "roscore", "-p", str(world.port))
    return {"roscore, start: s": up, "roscore, exit after Ctrl-C: s": down}


def node(world, _seconds):
    with master(world):
        up, down = run_until(world, "%25", "rosrun", "composiv_tryouts", "composiv_talker.py")
    return {"rosrun talker, first line: s": up, "rosrun talker, exit after Ctrl-C: s": down}


def launch(world, _seconds):
    """Launch the case study, and a copy whose talker publishes a hundred times a second instead of once.

    At 1 Hz, a listener that is connected just after the first message waits a second for the next one.
    """
    argv = ("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    up, down = run_until(world, "Battery level of vehicle", *argv)
    copied = Path(world.environment["HOME"], "composiv_tryouts")
    if not copied.exists():
        shutil.copytree(EXAMPLE / "composiv_tryouts", copied)
        talker = copied / "scripts" / "composiv_talker.py"
        talker.write_text(talker.read_text().replace("Rate(1)", "Rate(100)"))
    path = world.environment["ROS_PACKAGE_PATH"].replace(str(EXAMPLE), str(copied.parent))
    up_at_100_hz, _ = run_until(world, "Battery level of vehicle", *argv, ROS_PACKAGE_PATH=path)
    return {
        "roslaunch, first message received: s": up,
        "roslaunch, first message received, 100 Hz: s": up_at_100_hz,
        "roslaunch, exit after Ctrl-C: s": down,
    }


def test(world, _seconds):
    return {"rostest: s": run(world, "rostest", "composiv_tryouts", "composiv_tryout.launch")}


def build(world, _seconds):
    if not shutil.which("catkin_make", path=world.environment["PATH"]):
        return {}
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(EXAMPLE / "composiv_tryouts", Path(folder, "src", "composiv_tryouts"))
        argv = ("catkin_make", "-C", folder)
        return {"catkin_make: s": run(world, *argv), "catkin_make without changes: s": run(world, *argv)}


SCENES = {
    "rostopic": commands, "echo": echo, "completion": completion, "import": imports, "roscore": core,
    "rosrun": node, "roslaunch": launch, "rostest": test, "build": build,
}  # fmt: skip


def generate_messages(folder):
    """Generate the messages that genuine ROS needs for the example."""
    package = folder / "composiv_tryouts"
    messages = package / "msg"
    messages.mkdir(parents=True)
    (package / "__init__.py").touch()
    definition = EXAMPLE / "composiv_tryouts" / "msg" / "BatteryLevel.msg"
    options = ("-p", "composiv_tryouts", "-o", str(messages))
    for what in ([str(definition), *options], ["--initpy", *options]):
        argv = [GENUINE_PYTHON, "/usr/lib/genpy/genmsg_py.py", *what]
        subprocess.run(argv, check=True, env={"PATH": "/usr/bin:/bin"})


@contextlib.contextmanager
def open_worlds():
    """Open pipros and, if it is installed, genuine ROS, without masters."""
    with tempfile.TemporaryDirectory() as folder:
        worlds = [World("pipros", sys.executable, VARIABLES, master=None)]
        if Path("/usr/bin/roslaunch").exists() and Path("/usr/lib/genpy/genmsg_py.py").exists():
            generate_messages(Path(folder))
            more = {"PYTHONPATH": folder, "ROS_PACKAGE_PATH": f"{EXAMPLE}:/usr/share"}
            worlds.append(World("genuine", GENUINE_PYTHON, VARIABLES | more, master=None))
        yield worlds
        for world in worlds:
            world.close()


if __name__ == "__main__":
    compare(__doc__, SCENES, globals(), opened=open_worlds())
