"""Runs one program in a worker of a tab, with the arguments and the environment that a terminal gives it."""

from __future__ import annotations

import asyncio
import atexit
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from typing import Any

from pipros.basics import one_thread
from pipros.tab.network import Network, Port
from pipros.tab.sockets import HERE, install
from pipros.tab.turns import WorkerTurns

INTERRUPTED = 130


class RingPort:
    """The rings of the worker (`page/process.mjs`) as a `pipros.tab.network.Port`."""

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


def run(rings: Any, program: Mapping[str, Any]) -> int:
    """Run a program and return its exit code; see `run_with`. Called by the worker's JavaScript."""
    asyncio._set_running_loop(None)  # Pyodide's own loop does not run while Python does
    return run_with(RingPort(rings), program)


def run_with(port: Port, program: Mapping[str, Any]) -> int:
    """Run a program and return its exit code.

    Args:
        port: the worker's connection to the hub.
        program: `argv`, the command line, whose first item is a script or the name of a command; `files`,
            the content of files by path; `env`, environment variables.
    """
    network = Network(port)
    turns = WorkerTurns(network)
    install(network, turns.wait_for_network)
    one_thread.turns = turns
    time.sleep = turns.sleep  # callbacks run while a program sleeps, as everywhere
    signal.set_wakeup_fd = lambda *_args, **_options: -1  # a tab's sockets have no descriptors
    os.environ.update({"ROS_IP": HERE, "ROS_MASTER_URI": f"http://{HERE}:11311/", **program["env"]})
    for path, content in program["files"].items():
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content)
    sys.argv = list(program["argv"])
    code = _code_of(lambda: _run_command(sys.argv[0]))
    code = _code_of(atexit._run_exitfuncs) or code
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _run_command(name: str) -> object:
    """Run a script, or a command of the installed distributions.

    Raises:
        SystemExit: the command does not exist, or the program called `sys.exit`.
    """
    if "/" in name:
        import runpy

        return runpy.run_path(name, run_name="__main__")
    from importlib.metadata import entry_points

    for command in entry_points(group="console_scripts", name=name):
        sys.exit(command.load()())
    raise SystemExit(f"{name}: command not found")


def _code_of(call: Callable[[], object]) -> int:
    """Return the exit code that Python would have after a call."""
    try:
        call()
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        print(end.code, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except BaseException:
        traceback.print_exc()
        return 1
    return 0
