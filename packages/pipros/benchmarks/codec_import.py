#!/usr/bin/env python3
"""Time for the first use of a message type in a new process: pipros and genuine genpy.

    benchmarks/codec_import.py [--rounds 10]

"Cold" is the first process that uses a type, and "warm" is any later process, which reads the cache of
compiled types. As in codec.py, both run in the Python of genuine ROS, alternating.
"""

import argparse
import os
import subprocess
import sys
import tempfile

PYTHON = "/usr/bin/python3"
REPOSITORY = os.path.abspath(os.path.join(__file__, "..", "..", "..", ".."))
SOURCES = os.path.join(REPOSITORY, "build", "src")
SOURCE_PATH = os.pathsep.join(
    [SOURCES, *(os.path.join(REPOSITORY, "build", part) for part in ("facades", "internals"))]
)
PROGRAM = """
import time
start = time.perf_counter()
{imports}
from sensor_msgs.msg import Image
Image()
print((time.perf_counter() - start) * 1e3)
"""
HOOK = "import pipros.startup"
TARGETS_MS = {"cold": 30, "warm": 5, "warm, with a workspace": 5}
WORKSPACE = os.path.join(REPOSITORY, "examples", "catkin_ws", "src")


def milliseconds(options, imports, **variables):
    """Return the time that a new process prints for the import."""
    environment = {"PATH": "/usr/bin:/bin", **variables}
    command = [PYTHON, *options, "-c", PROGRAM.format(imports=imports)]
    answer = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)  # noqa: S603
    return float(answer.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=10)
    rounds = parser.parse_args().rounds
    best = dict.fromkeys(("genuine", *TARGETS_MS), float("inf"))
    with tempfile.TemporaryDirectory() as modules:
        for _ in range(rounds):
            with tempfile.TemporaryDirectory() as home:
                ours = {"PYTHONPATH": SOURCE_PATH, "PYTHONPYCACHEPREFIX": modules, "ROS_HOME": home}
                times = {
                    "genuine": milliseconds([], ""),
                    "cold": milliseconds(["-S"], HOOK, **ours),
                    "warm": milliseconds(["-S"], HOOK, **ours),
                    "warm, with a workspace": milliseconds(["-S"], HOOK, ROS_PACKAGE_PATH=WORKSPACE, **ours),
                }
            best.update({name: min(best[name], time) for name, time in times.items()})
    print("| first use of sensor_msgs/Image | ms | wanted |")
    print("| --- | ---: | ---: |")
    print(f"| genuine | {best['genuine']:.1f} | |")
    for name, target in TARGETS_MS.items():
        print(
            f"| pipros, {name} | {best[name]:.1f} | {target} {'ok' if best[name] <= target else 'MISSED'} |"
        )


if __name__ == "__main__":
    sys.exit(main())
