#!/usr/bin/env python3
"""Time and processor time of wheels for message packages, beside catkin_make: the figures in docs/pip.md.

    benchmarks/wheels.py [--packages 1,40]

Each package has one message. `pipros wheel` builds the wheels of a new workspace; `catkin_make` of pipros
and, if it is installed, that of genuine ROS build the same workspace.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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


def measure(command: list[str], folder: Path, path: str) -> str:
    """Return the time and the processor time of a command."""
    variables = {"PATH": path, "HOME": str(folder), "LANG": "C.UTF-8"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(command, cwd=folder, env=variables, check=True, capture_output=True)
    after, ended = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return f"{ended - began:6.1f} s ({processor_s:.1f} s)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--packages", default="1,40")
    counts = [int(count) for count in parser.parse_args().packages.split(",")]
    own = f"{PROGRAMS}{os.pathsep}/usr/bin{os.pathsep}/bin"
    commands = {"pipros wheel": ([str(PROGRAMS / "pipros"), "wheel", "."], own)}
    commands["catkin_make"] = ([str(PROGRAMS / "catkin_make")], own)
    if GENUINE.exists():
        commands["genuine catkin_make"] = ([str(GENUINE)], "/usr/bin:/bin")
    print(f"{'packages':>8}  {'command':20} time (processor time)")
    for count in counts:
        for name, (command, path) in commands.items():
            folder = Path(tempfile.mkdtemp())
            make_workspace(folder, count)
            print(f"{count:8}  {name:20} {measure(command, folder, path)}", flush=True)
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
