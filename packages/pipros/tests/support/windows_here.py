r"""Runs pipros on this Windows, with the plain interpreter: `script\demo.cmd`, `script\test.cmd`.

`demo` and `test` do what script/demo and script/test do on Linux; script\demo.cmd and script\test.cmd call
them. `proof` builds a workspace, ends each program of the case study with Ctrl-C, kills roslaunch, and prints
the table for the form "Windows". It needs a console of its own, because Ctrl-C reaches all programs in one.

A Python that has pipros is used as it is. Otherwise, .venv is made, and pipros installed in it.
"""

import argparse
import importlib.util
import os
import platform
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

REPOSITORY = Path(__file__).resolve().parents[4]
EXAMPLES = REPOSITORY / "examples" / "catkin_ws" / "src"
TESTED = {"pipros": ("master", "node", "safe", "wire"), "pipros-libraries": ("pictures",)}
TESTED |= {"pipros-server": ("policy",), "pipros-tools": ("graph",)}
"""Folders of unit tests that need nothing of Linux."""
EXTRAS = "monitor,numpy,pictures"
TEST_TOOLS = ("h11>=0.14", "hypothesis>=6.100", "pytest>=9.2", "pytest-timeout>=2.3")
"""What these need of the groups in pyproject.toml, which the pip of Python 3.11 cannot read."""
LAUNCH = ("roslaunch", "--screen", "composiv_tryouts", "composiv_tryout.launch")
START_S = 90.0
END_S = 30.0


def python(*packages: str) -> Path:
    """Return a Python that has pipros, with further packages if it was made here."""
    if importlib.util.find_spec("pipros"):
        return Path(sys.executable)
    folder = REPOSITORY / ".venv" / ("Scripts" if os.name == "nt" else "bin")
    program = folder / ("python.exe" if os.name == "nt" else "python")
    if not program.exists():
        print("making .venv", flush=True)
        _run(sys.executable, "-m", "venv", str(REPOSITORY / ".venv"))
    if packages or not list(folder.glob("roscore*")):
        also = ", and packages for its tests, about 30 MB," if packages else ""
        print(f"installing pipros{also} into .venv", flush=True)
        pip = [str(program), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        _run(*pip, "--editable", f"{REPOSITORY}[{EXTRAS}]" if packages else str(REPOSITORY), *packages)
    return program


def _run(*command: str) -> None:
    """Run a command to its end. If it fails, exit."""
    if code := subprocess.run(command, check=False).returncode:
        sys.exit(f"exit code {code}, for the reason above: {subprocess.list2cmdline(command)}")


class Program:
    """A running program, whose output is collected. A program in the background does not get Ctrl-C."""

    def __init__(
        self, command: Sequence[str], variables: dict[str, str], folder: Path, *, in_background: bool = False
    ) -> None:
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [shutil.which(command[0], path=variables["PATH"]) or command[0], *command[1:]],
            env=variables, cwd=folder, stdin=subprocess.DEVNULL if in_background else None,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=in_background,
            creationflags=getattr(subprocess, "DETACHED_PROCESS", 0) if in_background else 0,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self.lines.append(line.decode(errors="replace").rstrip())

    @property
    def output(self) -> str:
        return "\n".join(self.lines)

    def kill(self) -> None:
        self._process.kill()

    def shows(self, pattern: str) -> bool:
        """Wait until the output matches. Return False if the program ends before, or after `START_S`."""
        end = time.monotonic() + START_S
        while not (found := re.search(pattern, self.output)):
            if time.monotonic() > end or self._process.poll() is not None:
                break
            time.sleep(0.05)
        return bool(found)

    def wait(self, seconds: float) -> str:
        """Return the exit code, or `hung` after the program was killed because it did not end in time."""
        try:
            code = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            return "hung"
        self._reader.join(2)
        return str(code)


def press_ctrl_c(_: Program) -> None:
    """Send Ctrl-C to every program in this console. This one ignores it."""
    os.kill(0, getattr(signal, "CTRL_C_EVENT", signal.SIGINT))


class Proof:
    """Runs programs in a workspace, and prints a line of a table for each."""

    def __init__(self, interpreter: Path, folder: Path, times: int) -> None:
        scripts = interpreter.parent
        if not list(scripts.glob("roscore*")):
            scripts /= "Scripts"
        self.failed = False
        self._times = times
        self._folder = folder
        self._variables = {
            **os.environ, "PYTHONUNBUFFERED": "1", "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "ros home"),
            "PATH": os.pathsep.join([str(scripts), str(interpreter.parent), os.environ["PATH"]]),
            "ROS_PACKAGE_PATH": str(folder / "src"), "CMAKE_PREFIX_PATH": str(folder / "devel"),
        }  # fmt: skip
        self.take_port()

    def take_port(self) -> None:
        """Use another port for the master. After a process was killed, its port may stay in use."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._variables["ROS_MASTER_URI"] = f"http://127.0.0.1:{free.getsockname()[1]}"

    def start(self, *command: str, in_background: bool = False) -> Program:
        """Start a program, with the port of the master for `PORT` in its arguments."""
        port = self._variables["ROS_MASTER_URI"].rpartition(":")[2]
        words = [port if word == "PORT" else word for word in command]
        return Program(words, self._variables, self._folder, in_background=in_background)

    def run(self, *command: str, contains: str = "") -> None:
        """Run a program to its end."""
        began = time.monotonic()
        program = self.start(*command)
        code = program.wait(300)
        is_good = code == "0" and contains in program.output
        self._print(" ".join(command), f"{time.monotonic() - began:.1f} s", code, is_good=is_good)
        if not is_good:
            print(program.output, file=sys.stderr)

    def end(
        self, *command: str, when: str, by: Callable[[Program], None] = press_ctrl_c, file: Path | None = None
    ) -> None:
        """End a program repeatedly, each time when its output matches. None of its nodes may stay.

        If `file` is given, also wait until it contains more than the head of a bag.
        """
        codes: Counter[str] = Counter()
        left, longest = 0, 0.0
        for _ in range(self._times):
            if command[0] in ("roscore", "roslaunch"):
                self.take_port()
            began = time.monotonic()
            program = self.start(*command)
            if not program.shows(when):
                program.kill()
                print(f"{' '.join(command)} did not start: {program.output}", file=sys.stderr)
                codes["not started"] += 1
                continue
            processes = self._processes() if command[0] in ("roscore", "roslaunch") else []
            while (
                file and time.monotonic() < began + 20 and not (file.exists() and file.stat().st_size > 4500)
            ):
                time.sleep(0.05)
            began = time.monotonic()
            by(program)
            codes[program.wait(END_S)] += 1
            longest = max(longest, time.monotonic() - began)
            left += self._left(processes)
        good = codes["0"] if by is press_ctrl_c else codes.total() - codes["hung"] - codes["not started"]
        text = f"{good} of {self._times}, longest {longest:.1f} s, {left} processes left"
        how = "Ctrl-C" if by is press_ctrl_c else "killed"
        listed = ", ".join(f"{code} ({count})" for code, count in codes.items() if count)
        self._print(f"{' '.join(command)}: {how}", text, listed, is_good=good == self._times and not left)

    def _print(self, what: str, result: str, codes: str, *, is_good: bool) -> None:
        self.failed |= not is_good
        print(f"| {what} | {result} | {codes} | {'ok' if is_good else 'FAILED'} |", flush=True)

    def _processes(self) -> list[int]:
        """Return the process ids of the master and of all nodes."""
        uri = self._variables["ROS_MASTER_URI"]
        master: Any = ServerProxy(uri)
        state = master.getSystemState("/proof")[2]
        nodes = {node for kind in state for _, users in kind for node in users}
        peers: list[Any] = [ServerProxy(master.lookupNode("/proof", node)[2]) for node in nodes]
        return [peer.getPid("/proof")[2] for peer in (master, *peers)]

    def _left(self, processes: list[int]) -> int:
        """Return how many of the processes still run after ten seconds."""
        end = time.monotonic() + 10
        while (left := sum(map(_runs, processes))) and time.monotonic() < end:
            time.sleep(0.1)
        return left


def _runs(process: int) -> bool:
    if os.name != "nt":
        return Path(f"/proc/{process}").exists()
    import ctypes

    system: Any = ctypes
    kernel = system.windll.kernel32
    handle = kernel.OpenProcess(0x100000, False, process)  # SYNCHRONIZE
    if not handle:
        return False
    is_running = kernel.WaitForSingleObject(handle, 0) != 0
    kernel.CloseHandle(handle)
    return bool(is_running)


def prove(interpreter: Path, times: int) -> int:
    signal.signal(signal.SIGINT, lambda *_: None)
    print(f"{platform.platform()}, Python {platform.python_version()} ({platform.machine()})\n", flush=True)
    print("| what | result | exit codes | |\n| --- | --- | --- | --- |", flush=True)
    with tempfile.TemporaryDirectory(prefix="pipros proof ", ignore_cleanup_errors=True) as name:
        shutil.copytree(EXAMPLES, Path(name, "src"))
        proof = Proof(interpreter, Path(name), times)
        proof.run("catkin_make")
        proof.run("rostest", *LAUNCH[2:], contains="RESULT: SUCCESS")
        proof.run("pipros", "doctor", "--self-test")
        proof.end("roscore", "-p", "PORT", when="started core service")
        proof.end(*LAUNCH, when="Battery level of vehicle")
        proof.end(*LAUNCH, when="Battery level of vehicle", by=Program.kill)
        background = [proof.start("roscore", "-p", "PORT", in_background=True)]
        background[0].shows("started core service")
        publish = ("rostopic", "pub", "-r", "10", "/numbers", "std_msgs/Int32", "data: 5")
        background.append(proof.start(*publish, in_background=True))
        proof.end("rosrun", "composiv_tryouts", "composiv_talker.py", when="%25")
        proof.end("rostopic", "echo", "/numbers", when="data: 5")
        proof.end("rostopic", "hz", "/numbers", when="average rate")
        active = Path(name, "numbers.bag.active")
        proof.end("rosbag", "record", "-O", "numbers", "/numbers", when="Recording to", file=active)
        proof.run("rosbag", "info", "numbers.bag", contains="/numbers")
        for program in background:
            program.kill()
            program.wait(END_S)
    return int(proof.failed)


def main() -> int:
    parser = argparse.ArgumentParser(prog="windows_here.py", description="Runs pipros on this Windows.")
    parser.add_argument("what", choices=("demo", "test", "proof"))
    parser.add_argument("--times", type=int, default=10, metavar="N", help="how often `proof` ends each one")
    options, rest = parser.parse_known_args()
    os.chdir(REPOSITORY)
    if options.what == "proof":
        return prove(python(), options.times)
    if options.what == "demo":
        command = [python(), "examples/demo.py", *rest]
    else:
        tested = [
            str(Path("packages", each, "tests", "unit", name)) for each in TESTED for name in TESTED[each]
        ]
        command = [python(*TEST_TOOLS), "-m", "pytest", "-q", "-p", "no:cacheprovider", *(rest or tested)]
    process = subprocess.Popen([str(word) for word in command])
    signal.signal(signal.SIGINT, lambda *_: None)  # the program gets Ctrl-C, too
    return process.wait()


if __name__ == "__main__":
    sys.exit(main())
