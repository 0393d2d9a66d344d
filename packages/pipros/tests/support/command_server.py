"""Run command lines, each in a fork of this interpreter, which has imported what they need.

Reads lines of JSON `[argv, folder, environment]`; for each, it writes `[exit code, stdout, stderr, seconds of
processor time]`.
Runs under genuine ROS's Python and under pipros', so it needs only the standard library.
Usage: command_server.py MODULE…
"""

import gc
import importlib
import json
import os
import random
import runpy
import sys
import warnings
from typing import TextIO

READ_WHEN_IMPORTED = {"roslib.launcher", "rospy.names"}
"""Modules that read the environment and the command line when they are imported."""


def serve(answers: TextIO) -> list[str]:
    """Answer all lines. Return the command line in a fork, which then carries it out; otherwise nothing."""
    for line in sys.stdin:
        argv, folder, environment = json.loads(line)
        outputs = [os.memfd_create(name) for name in ("stdout", "stderr")]
        child = os.fork()
        if child == 0:
            answers.close()
            become(argv[0], folder, environment, outputs)
            return list(argv)
        _, status, used = os.wait4(child, 0)
        printed = []
        for output in outputs:
            os.lseek(output, 0, os.SEEK_SET)
            with open(output, encoding="utf-8", errors="replace") as file:
                printed.append(file.read())
        answers.write(
            json.dumps([os.waitstatus_to_exitcode(status), *printed, used.ru_utime + used.ru_stime]) + "\n"
        )
        answers.flush()
    return []


def become(program: str, folder: str, environment: dict[str, str], outputs: list[int]) -> None:
    """Give this process what a new interpreter would have found."""
    for number, file in enumerate([os.open(os.devnull, os.O_RDONLY), *outputs]):
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    path = environment.get("PYTHONPATH")
    sys.path[:0] = [os.path.dirname(program), *(path.split(os.pathsep) if path else ())]
    if environment.get("PYTHONWARNINGS") == "ignore":
        warnings.simplefilter("ignore")
    random.seed()


del sys.path[0]
for name in sys.argv[1:]:
    importlib.import_module(name)
gc.freeze()  # a collection would copy all pages to a fork
with os.fdopen(os.dup(1), "w") as stream:
    command = serve(stream)
if command:
    sys.argv[:] = command  # in place, because modules use the list as a default argument
    for name in READ_WHEN_IMPORTED & sys.modules.keys():
        importlib.reload(sys.modules[name])
    runpy.run_path(command[0], run_name="__main__")
