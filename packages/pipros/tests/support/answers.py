"""What commands answer, each in a fork of an interpreter that has already imported what they need.

Starting a command of genuine ROS takes 0.3 s of processor time or more, and a fork 0.05 s.
"""

import atexit
import json
import os
import select
import shutil
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path

from tests.support.environments import VENV_BIN, file_of_tests, genuine_environment, pipros_environment
from tests.support.processes import Process
from tests.support.started import STARTED

_GENUINE = (
    *("catkin.find_in_workspaces", "catkin_pkg.package_templates", "rosbag", "rosclean", "rosgraph"),
    *("roslaunch", "rosmsg", "rosnode", "rosparam", "rosservice", "rostest", "rostopic", "rosunit", "roswtf"),
)
_PIPROS = (
    *("catkin_find", "catkin_make", "rosbag", "roslaunch", "rosmsg", "rosnode"),
    *("rosparam", "rosrun", "rosservice", "rostest", "rostopic"),
)
_FORKED = ("catkin_", "ros")
"""How the names of commands start that run in forks, if they are scripts in Python."""

_spent_s: list[float] = []


class Answer(Process):
    """A command that has ended in a fork."""

    def __init__(self, argv: list[str], returncode: int, stdout: str, stderr: str) -> None:
        self.argv = argv
        self.stdout = stdout.splitlines()
        self.stderr = stderr.splitlines()
        self.lines = [*self.stdout, *self.stderr]
        self._returncode = returncode
        STARTED.add(self)

    @property
    def is_running(self) -> bool:
        return False

    @property
    def returncode(self) -> int:
        return self._returncode

    @property
    def transcript(self) -> list[str]:
        return [*self.lines, f"(exit code {self._returncode})"]

    def wait(self, timeout_s: float = 60.0) -> int:
        return self._returncode


def script_of(words: list[str], path: str) -> list[str] | None:
    """Return the command line of a script that can run in a fork; None for other programs."""
    if words[0] == "python3" and "".join(words[1:2]).endswith(".py"):
        return words[1:]
    found = shutil.which(words[0], path=path) if words[0].startswith(_FORKED) else None
    return [found, *words[1:]] if found is not None and _is_python(found) else None


@cache
def _is_python(program: str) -> bool:
    with open(program, "rb") as file:
        line = file.readline(200)
    return line.startswith(b"#!") and b"python" in line


class Interpreter:
    """An interpreter of genuine ROS or of pipros that runs `command_server.py`."""

    def __init__(self, is_genuine: bool) -> None:
        nowhere, uri = Path("/nonexistent"), "http://127.0.0.1:1"
        program = str(file_of_tests("support/command_server.py"))
        if is_genuine:
            command = ["/usr/bin/python3", program, *_GENUINE]
            environment = genuine_environment(nowhere, uri)
        else:
            command = [str(VENV_BIN / "python"), program, *(f"pipros_tools.cli.{name}" for name in _PIPROS)]
            environment = pipros_environment(nowhere, uri, nowhere)
        self._process = subprocess.Popen(
            command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            encoding="utf-8", start_new_session=True,
        )  # fmt: skip
        atexit.register(self.close)

    def answer(
        self, argv: list[str], folder: Path, environment: Mapping[str, str], timeout_s: float
    ) -> Answer:
        """Run the script `argv[0]` in a fork."""
        questions, answers = self._process.stdin, self._process.stdout
        assert questions is not None
        assert answers is not None
        questions.write(json.dumps([argv, str(folder), dict(environment)]) + "\n")
        questions.flush()
        if not select.select([answers], [], [], timeout_s)[0]:
            os.killpg(self._process.pid, signal.SIGKILL)
            interpreter.cache_clear()
            raise AssertionError(f"{' '.join(argv)} still runs after {timeout_s} s")
        line = answers.readline()
        assert line, f"the interpreter ended during {' '.join(argv)}"
        *answer, processor_s = json.loads(line)
        _spent_s.append(processor_s)
        return Answer(argv, *answer)

    def close(self) -> None:
        """End the interpreter; closing its input is not enough, which forks of this process may hold open."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate(timeout=10)


@cache
def interpreter(is_genuine: bool) -> Interpreter:
    """Return the one of this process."""
    return Interpreter(is_genuine)


def spent_s() -> float:
    """Return the processor time of all forks, which are no children of this process."""
    return sum(_spent_s)
