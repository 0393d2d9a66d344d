#!/usr/bin/env python3
"""The time that users wait for commands and launches: pipros and genuine ROS, in one run.

    script/bench startup [--rounds 3] [--only rostopic,roslaunch]

Both implementations alternate, each with its own master, and the median counts. If genuine ROS 1 is not
installed, only pipros is measured. Other load affects the figures more than the ratio.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast
from xmlrpc.client import ServerProxy

import psutil
from table import Row, markdown, write_json
from worlds import option_parser, ran_as_worker, taken_in_turn

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "catkin_ws" / "src"
READY_WITHIN_S = 30.0
MISSED_AFTER_S = 20.0
HELLO = ("std_msgs/String", "data: hello")


def free_port() -> int:
    """Return a port below those that the system assigns, so that no connection takes it before the master."""
    while True:
        port = random.randrange(20_000, 30_000)  # noqa: S311
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)):
                return port


def end(process: subprocess.Popen[str] | subprocess.Popen[bytes]) -> None:
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


class World:
    """One implementation, which defines how its programs are started, and its home folder."""

    def __init__(self, name: str, path: str, home: Path, **variables: str) -> None:
        self.name = name
        home.mkdir()
        self.port = free_port()
        self.environment = {
            "PATH": path,
            "HOME": str(home),
            "ROS_HOME": str(home / ".ros"),
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_PACKAGE_PATH": str(EXAMPLE),
            "ROS_IP": "127.0.0.1",
            "LANG": "C.UTF-8",
            "PYTHONUNBUFFERED": "1",
            **variables,
        }

    def run(self, *argv: str) -> float:
        """Return the duration in seconds of a command that must succeed."""
        began = time.perf_counter()
        ended = subprocess.run(  # noqa: S603
            argv, env=self.environment, capture_output=True, text=True, check=False
        )
        seconds = time.perf_counter() - began
        if ended.returncode:
            raise SystemExit(f"{self.name}: {' '.join(argv)} failed:\n{ended.stdout}{ended.stderr}")
        return seconds

    def run_until(self, line: str, *argv: str, **variables: str) -> tuple[float, float]:
        """Return the seconds until a line contains `line`, and from Ctrl-C to the end of all processes."""
        began = time.perf_counter()
        process = subprocess.Popen(  # noqa: S603
            argv,
            env={**self.environment, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        output = cast("IO[str]", process.stdout)
        printed = []
        for printed_line in output:
            printed.append(printed_line)
            if line in printed_line:
                break
        else:
            raise SystemExit(f"{self.name}: {' '.join(argv)} ended without '{line}':\n{''.join(printed)}")
        seen = time.perf_counter()
        end(process)
        return seen - began, time.perf_counter() - seen

    @contextmanager
    def running(self, *argv: str) -> Iterator[None]:
        """Run a command in the background while the block runs."""
        process = subprocess.Popen(  # noqa: S603
            argv,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            yield
        finally:
            end(process)

    @contextmanager
    def master(self) -> Iterator[None]:
        with self.running("roscore", "-p", str(self.port)):
            self._wait_for_rosout()
            yield

    def _wait_for_rosout(self) -> None:
        deadline = time.monotonic() + READY_WITHIN_S
        while time.monotonic() < deadline:
            try:
                with ServerProxy(self.environment["ROS_MASTER_URI"]) as master:
                    if master.lookupNode("/benchmark", "/rosout")[0] == 1:  # type: ignore[index]
                        return
            except OSError:
                pass
            time.sleep(0.02)
        raise SystemExit(f"{self.name}: no roscore within {READY_WITHIN_S} s")


def commands(world: World) -> dict[str, float]:
    with world.master():
        world.run("rosparam", "set", "/rate", "10")
        world.run("rosparam", "set", "/robot", "{name: r1, wheels: [1.5, 2.5], base: {width: 0.4}}")
        return {
            "rostopic list: s": world.run("rostopic", "list"),
            "rosnode list: s": world.run("rosnode", "list"),
            "rosparam get, a number: s": world.run("rosparam", "get", "/rate"),
            "rosparam get, a string of two lines: s": world.run("rosparam", "get", "/rosversion"),
            "rosparam get, a dictionary: s": world.run("rosparam", "get", "/robot"),
            "rosmsg show sensor_msgs/JointState: s": world.run("rosmsg", "show", "sensor_msgs/JointState"),
        }


def echo(world: World) -> dict[str, float]:
    """Publish a latched message in advance, so that only the command's time is measured."""
    with world.master(), world.running("rostopic", "pub", "-l", "/latched", *HELLO):
        # when this command ends, the publisher is available
        world.run("rostopic", "echo", "-n", "1", "/latched")
        return {"rostopic echo -n 1, latched: s": world.run("rostopic", "echo", "-n", "1", "/latched")}


def completion(world: World) -> dict[str, float]:
    """Complete `rostopic echo /<TAB>` as a shell does; for genuine ROS, with rosbash's function."""
    if world.name == "genuine":
        command = (
            "bash", "-c", "source /usr/share/bash-completion/completions/rosbash; "
            "COMP_WORDS=(rostopic echo /); COMP_CWORD=2; _roscomplete_rostopic; [ ${#COMPREPLY[@]} -gt 0 ]",
        )  # fmt: skip
    else:
        command = ("pipros-complete", "2", "rostopic", "echo", "/")
    with world.master():
        return {"rostopic echo /<TAB>: s": world.run(*command)}


def imports(world: World) -> dict[str, float]:
    return {"import rospy: s": world.run("python3", "-c", "import rospy")}


def core(world: World) -> dict[str, float]:
    up, down = world.run_until("started core service", "roscore", "-p", str(world.port))
    return {"roscore, start: s": up, "roscore, exit after Ctrl-C: s": down}


def node(world: World) -> dict[str, float]:
    with world.master():
        up, down = world.run_until("%25", "rosrun", "composiv_tryouts", "composiv_talker.py")
    return {"rosrun talker, first line: s": up, "rosrun talker, exit after Ctrl-C: s": down}


def launch(world: World) -> dict[str, float]:
    """Launch the case study, and a copy whose talker publishes a hundred times a second instead of once.

    At 1 Hz, a listener that is connected just after the first message waits a second for the next one.
    """
    argv = ("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
    up, down = world.run_until("Battery level of vehicle", *argv)
    copied = Path(world.environment["HOME"], "composiv_tryouts")
    if not copied.exists():
        shutil.copytree(EXAMPLE / "composiv_tryouts", copied)
        talker = copied / "scripts" / "composiv_talker.py"
        talker.write_text(talker.read_text().replace("Rate(1)", "Rate(100)"))
    path = world.environment["ROS_PACKAGE_PATH"].replace(str(EXAMPLE), str(copied.parent))
    up_at_100_hz, _ = world.run_until("Battery level of vehicle", *argv, ROS_PACKAGE_PATH=path)
    return {
        "roslaunch, first message received: s": up,
        "roslaunch, first message received, 100 Hz: s": up_at_100_hz,
        "roslaunch, exit after Ctrl-C: s": down,
    }


def test(world: World) -> dict[str, float]:
    return {"rostest: s": world.run("rostest", "composiv_tryouts", "composiv_tryout.launch")}


def build(world: World) -> dict[str, float]:
    if not shutil.which("catkin_make", path=world.environment["PATH"]):
        return {}
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(EXAMPLE / "composiv_tryouts", Path(folder, "src", "composiv_tryouts"))
        argv = ("catkin_make", "-C", folder)
        return {"catkin_make: s": world.run(*argv), "catkin_make without changes: s": world.run(*argv)}


SCENES: dict[str, Callable[[World], dict[str, float]]] = {
    "rostopic": commands,
    "echo": echo,
    "completion": completion,
    "import": imports,
    "roscore": core,
    "rosrun": node,
    "roslaunch": launch,
    "rostest": test,
    "build": build,
}


@contextmanager
def generated_messages(folder: Path) -> Iterator[Path | None]:
    """Yield the folder with the generated messages that genuine ROS needs for the example; None if genuine
    ROS is not installed.
    """
    generator = Path("/usr/lib/genpy/genmsg_py.py")
    if not Path("/usr/bin/roslaunch").exists() or not generator.exists():
        yield None
        return
    package = folder / "composiv_tryouts"
    messages = package / "msg"
    messages.mkdir(parents=True)
    (package / "__init__.py").touch()
    definition = EXAMPLE / "composiv_tryouts" / "msg" / "BatteryLevel.msg"
    options = ("-p", "composiv_tryouts", "-o", str(messages))
    for what in ([str(definition), *options], ["--initpy", *options]):
        argv = ["/usr/bin/python3", str(generator), *what]
        subprocess.run(argv, check=True, env={"PATH": "/usr/bin:/bin"})  # noqa: S603
    yield folder


def main() -> None:
    options = option_parser(__doc__ or "", SCENES, 0.0).parse_args()
    ran_as_worker(options, {})
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        own = f"{Path(sys.executable).parent}:/usr/bin:/bin"
        worlds = [World("pipros", own, folder / "pipros")]
        with generated_messages(folder / "generated") as generated:
            if generated:
                more = {"PYTHONPATH": str(generated), "ROS_PACKAGE_PATH": f"{EXAMPLE}:/usr/share"}
                worlds.append(World("genuine", "/usr/bin:/bin", folder / "genuine", **more))
            for scene in options.only.split(",") if options.only else SCENES:
                rows += taken_in_turn(SCENES[scene], worlds, options.rounds)
    print(markdown(rows))
    if options.json:
        write_json(options.json, rows)


if __name__ == "__main__":
    main()
