"""Runs one program in a worker of a tab, with the arguments and the environment that a terminal gives it."""

from __future__ import annotations

import asyncio
import atexit
import gc
import importlib
import os
import random
import signal
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import pipros
from pipros.basics import one_thread
from pipros_tab import files, processes
from pipros_tab.command_run import Replaced, code_of, run_words
from pipros_tab.filters import run_before
from pipros_tab.network import Network, Port
from pipros_tab.packets import PacketKind
from pipros_tab.sockets import install
from pipros_tab.tab_socket import HERE
from pipros_tab.turns import WorkerTurns, distinct_ns

HOME = "/home/student"
_PYTHON = "/usr/bin/python3"
_PLACEHOLDERS = ("/usr/bin/env", _PYTHON)
"""Programs that a tab lacks, but that `rosrun` looks for before it starts a script."""

PREPARED = (
    "rospy",
    "pipros_tools.launch.run",
    "pipros_tab.terminal",
    "pipros_workspace.environment",
    "pipros_workspace.overlays",
    "std_msgs.msg",
)
"""Modules that most programs import."""


class _NoPort:
    """The port of a worker that is not connected yet."""

    def send(self, _kind: int, _end: int, _content: bytes) -> None:
        raise RuntimeError("the worker is not connected yet")

    def receive(self, _timeout_s: float) -> bytes:
        return b""

    def is_interrupted(self) -> bool:
        return False


class RingPort:
    """The rings of the worker (`page/process.mjs`) as a `pipros_tab.network.Port`."""

    def __init__(self, rings: Any) -> None:
        self._rings = rings
        self._content, self._received = rings.content, rings.received

    def send(self, kind: int, end: int, content: bytes) -> None:
        if content:
            self._content.subarray(0, len(content)).assign(content)
        self._rings.send(kind, end, len(content))

    def receive(self, timeout_s: float) -> bytes:
        size = self._rings.receive(timeout_s * 1000)
        return bytes(self._received.subarray(0, size).to_bytes()) if size else b""

    def is_interrupted(self) -> bool:
        return bool(self._rings.isInterrupted())


_prepared: list[Worker] = []


class Worker:
    """A worker without a program yet, but with replacements for sockets and processes."""

    def __init__(self, port: Port) -> None:
        """Replace what a worker lacks. Call this before other modules are imported."""
        self._network = Network(port)
        self._turns = turns = WorkerTurns(self._network)
        install(self._network, turns.wait_for_network)
        one_thread.turns = turns
        time.sleep = turns.sleep  # callbacks run while a program sleeps
        time.time_ns = partial(next, distinct_ns(time.time_ns))
        threading.Condition.wait = lambda *args, **more: turns.wait_for_condition(*args, **more)  # type: ignore[method-assign]
        signal.set_wakeup_fd = lambda *_args, **_options: -1  # a tab's sockets have no descriptors
        os.execve = os.execvpe = _replace  # type: ignore[assignment]

    def connect(self, port: Port) -> None:
        """Use these rings from now on."""
        self._network.port = port

    def run(self, program: Mapping[str, Any]) -> int:
        """Run a program, and return its exit code.

        Args:
            program: `argv`, the command line, whose first item is a script or the name of a command, or
                `bash` for a terminal; `files`, text, or mode and bytes, by path; `environment`, all
                variables, or `env`, further ones; `folder`, where it begins, the home folder by default;
                `stdout` and `stderr`, paths, or None for the terminal; `filters`, through which
                its output passes; `number`, of the process.
        """
        if "environment" in program:
            os.environ.clear()
            os.environ.update(program["environment"])
        os.environ.update({"ROS_IP": HERE, **program.get("env", {})})
        os.environ.setdefault("ROS_MASTER_URI", f"http://{HERE}:11311/")
        if "number" in program:
            os.getpid = lambda: int(program["number"])
        home = os.path.expanduser("~")
        os.makedirs(home, exist_ok=True)
        files.write_all(program.get("files", {}))
        shared = files.SharedFiles(home, lambda content: self._network.send(PacketKind.FILE, 0, content))
        self._network.take_file = shared.take
        processes.install(self._network, self._turns, shared, threading.Thread)
        os.chdir(program.get("folder") or home)
        for descriptor, stream in ((1, "stdout"), (2, "stderr")):
            if program.get(stream):
                _redirect(descriptor, program[stream])
        filters = processes.TabProcess.filters = program.get("filters") or ()
        if program["argv"][0] == "bash":
            from pipros_tab.terminal import Terminal

            code = Terminal(self._network, self._turns, shared).run()
        else:
            code = run_before(filters, lambda: run_words(program["argv"]), sys.stdout)
        code = code_of(atexit._run_exitfuncs) or code
        sys.stdout.flush()
        sys.stderr.flush()
        shared.push()
        return code


def prepare() -> None:
    """Prepare Python for any program. Further workers start with a copy of this worker's memory."""
    asyncio._set_running_loop(None)  # Pyodide's own loop does not run while Python does
    share = Path(pipros.__file__).parent / "share"
    for file in share.glob("*/**/*"):
        if file.is_file() and file.read_bytes().startswith(b"#!"):
            file.chmod(0o755)  # Pyodide's archives lose the modes
    sys.executable = _PYTHON
    if not hasattr(time, "thread_time"):
        time.thread_time = time.process_time  # the only thread of the process
    os.environ.update({"PATH": "/usr/bin", "HOME": HOME, "TERM": "dumb", "USER": "student"})
    _prepared.append(Worker(_NoPort()))
    for name in PREPARED:
        importlib.import_module(name)
    gc.collect()


def start(rings: Any) -> Worker:
    """Connect a worker, in which `prepare` has run, to its rings."""
    asyncio._set_running_loop(None)
    random.seed()  # a copy would draw the same numbers
    for path in _PLACEHOLDERS:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        Path(path).touch(0o755)
    (worker,) = _prepared
    worker.connect(RingPort(rings))
    return worker


def run_with(port: Port, program: Mapping[str, Any]) -> int:
    """Run a program; see `Worker.run`."""
    return Worker(port).run(program)


def _redirect(descriptor: int, path: str) -> None:
    opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(opened, descriptor)
    os.close(opened)


def _replace(_file: str, words: Sequence[str], environment: Mapping[str, str]) -> NoReturn:
    raise Replaced(words, environment)
