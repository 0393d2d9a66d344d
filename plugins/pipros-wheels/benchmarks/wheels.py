#!/usr/bin/env python3
"""Time and processor time of wheels for message packages, beside catkin_make: figures of docs/guides/pip.md.

    script/bench wheels [--packages 1,40] [--rounds 3]

Each package has one message. `pipros wheel` builds the wheels of a new workspace; pipros's `catkin_make`
and, if it is installed, that of genuine ROS build the same workspace. The commands take turns; the medians
are printed, with the ratio of the processor times to that of `pipros wheel`, and the load of the machine.
"""

from __future__ import annotations

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from table import options_of

MANIFEST = """<package format="2"><name>{0}</name><version>1.0.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend><depend>message_generation</depend></package>
"""
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project({0})
find_package(catkin REQUIRED COMPONENTS message_generation)
add_message_files(FILES State.msg)
generate_messages()
catkin_package()
"""
PROGRAMS = Path(sys.executable).parent
GENUINE = Path("/usr/bin/catkin_make")


def make_workspace(folder: Path, count: int) -> None:
    for number in range(count):
        name = f"part{number}_msgs"
        package = folder / "src" / name
        (package / "msg").mkdir(parents=True)
        (package / "package.xml").write_text(MANIFEST.format(name))
        (package / "CMakeLists.txt").write_text(CMAKE.format(name))
        (package / "msg" / "State.msg").write_text("int8 level\n")


def measure(command: list[str], folder: Path, path: str) -> tuple[float, float]:
    """Return the time and the processor time of a command, in seconds."""
    variables = {"PATH": path, "HOME": str(folder), "LANG": "C.UTF-8"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(command, cwd=folder, env=variables, check=True, capture_output=True)
    after, ended = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    return ended - began, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compare(commands: dict[str, tuple[list[str], str]], count: int, rounds: int) -> None:
    """Print a line for each command, with workspaces of `count` packages."""
    measured: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for _ in range(rounds):
        for name, (command, path) in commands.items():
            folder = Path(tempfile.mkdtemp())
            make_workspace(folder, count)
            measured[name].append(measure(command, folder, path))
            shutil.rmtree(folder)
    first = 0.0
    for name, pairs in measured.items():
        time_s, processor_s = (statistics.median(values) for values in zip(*pairs, strict=True))
        first = first or processor_s
        print(f"{count:8}  {name:20} {time_s:8.1f} s {processor_s:10.1f} s {processor_s / first:8.1f}")


def main() -> None:
    options = options_of(__doc__, packages="1,40", rounds=3)
    own = f"{PROGRAMS}{os.pathsep}/usr/bin{os.pathsep}/bin"
    commands = {"pipros wheel": ([str(PROGRAMS / "pipros"), "wheel", "."], own)}
    commands["catkin_make"] = ([str(PROGRAMS / "catkin_make")], own)
    if GENUINE.exists():
        commands["genuine catkin_make"] = ([str(GENUINE)], "/usr/bin:/bin")
    load = os.getloadavg()[0]
    print(f"{'packages':>8}  {'command':20} {'time':>10} {'processor':>12} {'ratio':>8}")
    for count in options.packages.split(","):
        compare(commands, int(count), options.rounds)
    print(f"load of {os.cpu_count()} processors: {load:.1f} before, {os.getloadavg()[0]:.1f} after")


if __name__ == "__main__":
    main()
