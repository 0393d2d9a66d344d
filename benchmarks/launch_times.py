"""Waiting times for roscore, roslaunch and catkin_make: pipros and genuine ROS 1, in one run.

    .venv/bin/python benchmarks/launch_times.py [rounds]

Prints the median of each figure in seconds. Genuine ROS is left out if it is not installed.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from table import heed_interrupts

EXAMPLES = Path(__file__).resolve().parents[1] / "examples" / "catkin_ws" / "src"
OWN_PROGRAMS = str(Path(sys.executable).parent)
SIDES = {"pipros": f"{OWN_PROGRAMS}:/usr/bin:/bin", "genuine": "/usr/bin:/bin"}

# Each program, the line that shows that the program is ready, and the names of the two times.
PROGRAMS = {
    "roscore": (["roscore", "-p", "{port}"], r"started core service"),
    "roslaunch": (["roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch"], r"\[INFO\].*%25"),
}


def environment(path: str, port: int, home: str, modules: str) -> dict[str, str]:
    """Return the environment for one side. Compiled modules may be cached, as on a normal machine.

    Args:
        modules: the folder with the built message for genuine ROS; pipros reads the definition.
    """
    return {
        "HOME": home,
        "PATH": path,
        "ROS_HOME": home,
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_PACKAGE_PATH": f"{EXAMPLES}:/usr/share" if path == SIDES["genuine"] else str(EXAMPLES),
        "PYTHONPATH": modules if path == SIDES["genuine"] else "",
    }


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def measure(command: list[str], line: str, path: str, modules: str) -> tuple[float, float]:
    """Return the seconds from the start to the line, and from Ctrl-C to the end."""
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        controller, terminal = os.openpty()
        started = time.perf_counter()
        process = subprocess.Popen(
            [word.format(port=port) for word in command],
            env=environment(path, port, home, modules),
            stdin=terminal,
            stdout=terminal,
            stderr=terminal,
            start_new_session=True,
        )
        os.close(terminal)
        seen = b""
        while not re.search(line.encode(), seen):
            seen += os.read(controller, 65536)
        shown = time.perf_counter()
        time.sleep(0.5)
        os.killpg(process.pid, signal.SIGINT)
        interrupted = time.perf_counter()
        drain(controller)
        process.wait()
        ended = time.perf_counter()
        os.close(controller)
    return shown - started, ended - interrupted


def drain(controller: int) -> None:
    """Read until every process has closed the terminal."""
    try:
        while os.read(controller, 65536):
            pass
    except OSError:
        return


def build(path: str) -> tuple[float, float]:
    """Return the seconds that `catkin_make` takes for the example, and the seconds for a second run without
    changes.
    """
    with tempfile.TemporaryDirectory() as home:
        shutil.copytree(EXAMPLES / "composiv_tryouts", Path(home, "ws", "src", "composiv_tryouts"))
        times = []
        for _ in range(2):
            started = time.perf_counter()
            command = ["catkin_make", "-C", f"{home}/ws"]
            subprocess.run(command, env={"HOME": home, "PATH": path}, check=True, capture_output=True)
            times.append(time.perf_counter() - started)
    return times[0], times[1]


def build_modules(home: str) -> str:
    """Build the example's message with genuine catkin. Return the folder of its Python modules."""
    shutil.copytree(EXAMPLES / "composiv_tryouts", Path(home, "ws", "src", "composiv_tryouts"))
    environment = {"HOME": home, "PATH": SIDES["genuine"], "CMAKE_PREFIX_PATH": "/usr"}
    subprocess.run(["catkin_make", "-C", f"{home}/ws"], env=environment, check=True, capture_output=True)
    return f"{home}/ws/devel/lib/python3/dist-packages"


def main() -> None:
    heed_interrupts()
    with tempfile.TemporaryDirectory() as home:
        compare(build_modules(home) if shutil.which("catkin_make", path=SIDES["genuine"]) else "")


def compare(modules: str) -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    sides = {side: path for side, path in SIDES.items() if shutil.which("roslaunch", path=path)}
    print(f"{'median of ' + str(rounds):32}" + "".join(f"{side:>10}" for side in sides))
    for program, (command, line) in PROGRAMS.items():
        times = {
            side: [measure(command, line, path, modules) for _ in range(rounds)]
            for side, path in sides.items()
        }
        for index, what in enumerate(("until its line is seen", "from Ctrl-C to the end")):
            medians = [statistics.median(pair[index] for pair in pairs) for pairs in times.values()]
            print(f"{program + ' ' + what:32}" + "".join(f"{median:>10.3f}" for median in medians))
    for index, what in enumerate(("catkin_make", "catkin_make, nothing changed")):
        medians = [statistics.median(build(path)[index] for _ in range(3)) for path in sides.values()]
        print(f"{what:32}" + "".join(f"{median:>10.3f}" for median in medians))


if __name__ == "__main__":
    main()
