#!/usr/bin/env python3
"""How many drafts of `pipros port` run with genuine rclpy: at once, and after their TODOs are done.

    script/bench port_drafts [--distro kilted] [--seconds 12]

The nodes are those of tests/unit/ros2/port_nodes.txt and of rospy_tutorials. They run beside a node that
publishes and serves what they need. A draft runs if it prints no error in these seconds, ends after Ctrl-C if
it has not ended, and prints DONE if its text does. finished_drafts.patch is what was done by hand for the
TODOs. The messages that rclpy of tests.support.ros2_wheels lacks are built with `pipros wheel --ros2`: the
benchmark needs a C++ compiler.
"""

import contextlib
import io
import os
import re
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from table import heed_interrupts, options_of

ROOT = Path(__file__).resolve().parents[3]
PATCH = Path(__file__).with_name("finished_drafts.patch")
NODES = ROOT / "plugins" / "pipros-ros2" / "tests" / "unit" / "ros2" / "port_nodes.txt"
WHEELS = ("example_interfaces", "nav_msgs", "rospy_tutorials", "tf2_msgs", "visualization_msgs")
ERROR = re.compile(r"^Traceback|^[\w.]*Error:.*|.*\[(?:ERROR|FATAL)\].*", re.MULTILINE)
AT_ONCE = 4
STIMULUS = """
import rclpy
from geometry_msgs.msg import TransformStamped, Twist
from rclpy.action import ActionServer
from rospy_tutorials.srv import AddTwoInts
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from std_msgs.msg import Float64, Int32, String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci
from tf2_msgs.msg import TFMessage

rclpy.init()
node = rclpy.create_node("stimulus")
frame = TransformStamped(child_frame_id="base")
frame.header.frame_id = "odom"
image = Image(height=2, width=2, encoding="rgb8", step=6, data=bytes(12))
values = {
    "scan": LaserScan(ranges=[0.5, 2.0]), "image": image, "camera_info": CameraInfo(header=image.header),
    "state": Float64(data=1.0), "chatter": String(data="hello"), "a": Int32(data=1), "b": Int32(data=2),
    "cmd_vel": Twist(), "tf": TFMessage(transforms=[frame]),
}
publishers = {name: node.create_publisher(type(value), name, 10) for name, value in values.items()}
node.create_timer(0.1, lambda: [publishers[name].publish(value) for name, value in values.items()])
add = lambda request, response: AddTwoInts.Response(sum=request.a + request.b)
node.create_service(SetBool, "stimulus_switch", lambda request, response: SetBool.Response(success=True))
node.create_service(Trigger, "stimulus_trigger", lambda request, response: Trigger.Response(success=True))
node.create_service(AddTwoInts, "add_two_ints", add)

def count(goal):
    goal.succeed()
    return Fibonacci.Result(sequence=[0, 1, 1, 2, 3])

server = ActionServer(node, Fibonacci, "fibonacci", count)
print("ready", flush=True)
rclpy.spin(node)
"""


def environment_with_messages(distro):
    """Return an environment with rclpy and the wheels, which is made once."""
    from tests.support.once import machine_folder, make_once
    from tests.support.ros2_wheels import environment

    genuine = environment(distro)
    folder = machine_folder(
        f"port_drafts_{distro}", [Path(__file__), ROOT / "plugins/pipros-wheels/src/pipros_wheels"]
    )

    def make():
        subprocess.run(["cp", "-a", f"{genuine}/.", folder], check=True)
        (folder / ".made").unlink()
        with tempfile.TemporaryDirectory() as home:
            cache = Path(home, ".ros", "pipros")
            cache.mkdir(parents=True)
            (cache / f"ros2_{distro}_{sys.implementation.cache_tag}").symlink_to(genuine)
            wheel = (Path(sys.executable).with_name("pipros"), "wheel", "--ros2", distro, "--output", home)
            subprocess.run([*wheel, *WHEELS], check=True, env={**os.environ, "HOME": home})
            pip = (sys.executable, "-m", "pip", "--python", folder / "bin" / "python", "install", "--no-deps")
            subprocess.run([*pip, "--quiet", "--no-index", *Path(home).glob("*.whl")], check=True)

    make_once(folder, make)
    return folder / "bin" / "python"


def write_drafts(folder):
    """Write all drafts to subfolders, as `pipros port --write` does."""
    from pipros_ros2.commands.port import main

    source = folder / "source"
    source.mkdir()
    for part in re.split(r"^=== ", NODES.read_text(), flags=re.MULTILINE)[1:]:
        name, _, text = part.partition("\n")
        (source / f"{name}.py").write_text(text)
    with contextlib.redirect_stdout(io.StringIO()):
        for what, name in ((str(source), "nodes"), ("rospy_tutorials", "rospy_tutorials")):
            assert main(["--write", str(folder / "drafts" / name), what]) == 0


def start(python, words, output):
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "ROS_"))}
    own = {"ROS_DOMAIN_ID": "64", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONUNBUFFERED": "1"}
    environment = {**kept, **own, "ROS_LOG_DIR": f"{output.name}.logs"}
    return subprocess.Popen([python, *words], stdout=output, stderr=subprocess.STDOUT, env=environment)


def ended(process, timeout_s):
    try:
        return process.wait(timeout_s) is not None
    except subprocess.TimeoutExpired:
        return False


def problem(python, seconds, draft):
    """Return why a draft does not run; empty if it runs."""
    with tempfile.NamedTemporaryFile() as output:
        process = start(python, [draft], output)
        stopped = ended(process, seconds)
        text = Path(output.name).read_text(errors="replace")
        if not stopped:
            process.send_signal(signal.SIGINT)
            if not ended(process, 15):
                process.kill()
                process.wait()
                return "does not end"
        found = ERROR.findall(text)
        if found or (stopped and process.returncode):
            return found[-1] if found else f"exit code {process.returncode}: {text.strip()[-200:]}"
        return "never prints DONE" if '"DONE"' in draft.read_text() and "DONE" not in text else ""


def problems(python, seconds, drafts):
    with ThreadPoolExecutor(AT_ONCE) as executor:
        return dict(zip(drafts, executor.map(partial(problem, python, seconds), drafts), strict=True))


def main():
    options = options_of(__doc__, distro="jazzy", seconds=12.0)
    heed_interrupts()
    python = environment_with_messages(options.distro)
    with tempfile.TemporaryDirectory() as name, tempfile.NamedTemporaryFile() as output:
        folder = Path(name)
        write_drafts(folder)
        files = [file for file in sorted((folder / "drafts").rglob("*")) if file.is_file()]
        drafts = [file for file in files if file.parts[-2] == "nodes" or file.read_text().startswith("#!")]
        before = {file: file.read_text() for file in drafts}
        stimulus = start(python, ["-c", STIMULUS], output)
        try:
            while "ready" not in Path(output.name).read_text():
                assert not ended(stimulus, 0.1), Path(output.name).read_text()
            first = problems(python, options.seconds, drafts)
            subprocess.run(["git", "apply", "--unidiff-zero", PATCH], check=True, cwd=folder / "drafts")
            changed = [file for file in drafts if file.read_text() != before[file]]
            last = {**first, **problems(python, options.seconds, changed)}
        finally:
            stimulus.terminate()
            stimulus.wait()
        for file in drafts:
            if first[file] or last[file]:
                after = last[file] or "runs"
                print(f"{file.relative_to(folder / 'drafts')}: {first[file]}; after the TODOs: {after}")
        done = f"TODOs done by hand in {len(changed)} drafts"
        print(f"ROS 2 {options.distro}, {options.seconds:g} s each; {done}")
        for kind in ("nodes", "rospy_tutorials"):
            own = [file for file in drafts if file.relative_to(folder / "drafts").parts[0] == kind]
            counts = [sum(not each[file] for file in own) for each in (first, last)]
            print(f"{kind}: {len(own)} drafts, {counts[0]} run at once, {counts[1]} after the TODOs")


if __name__ == "__main__":
    main()
