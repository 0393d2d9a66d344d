"""A tab whose workers run Pyodide in Node.js (`plugins/pipros-tab/tests/pyodide/tab.mjs`)."""

from __future__ import annotations

import json
import re
import subprocess
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.support.environments import REPOSITORY
from tests.support.waiting import wait_until

STARTED_WITHIN_S = 240.0
"""Several workers may start Pyodide at the same time, on a busy machine."""


class Program:
    """A program in a worker.

    Attributes:
        number: the number of the worker.
        output: what it has printed.
        code: its exit code, or None while it runs.
    """

    def __init__(self, tab: PyodideTab, number: int) -> None:
        self.number = number
        self.output = ""
        self.code: int | None = None
        self._tab = tab

    def wait_for_output(self, text: str) -> None:
        """Wait until the program has printed a text.

        Raises:
            AssertionError: it has ended without it.
        """
        wait_until(lambda: text in self.output or self.code is not None, STARTED_WITHIN_S)
        assert text in self.output, self.output

    def wait(self) -> int:
        """Wait for the end, and return the exit code."""
        wait_until(lambda: self.code is not None, STARTED_WITHIN_S)
        assert self.code is not None
        return self.code

    def interrupt(self) -> float:
        """Interrupt the program, as Ctrl-C does. Return how long its end took."""
        return self._end("interrupt")

    def stop(self) -> float:
        """End the program at once. Return how long it took."""
        return self._end("stop")

    def _end(self, order: str) -> float:
        before = time.monotonic()
        self._tab.order({order: self.number})
        self.wait()
        return time.monotonic() - before


class PyodideTerminal:
    """A terminal, in which one types lines."""

    PROMPT = "\033]133;P;"
    ENDED = re.compile("\033\\]133;D;[^\007]*\007")  # with the line, for the page's steps

    def __init__(self, tab: PyodideTab, program: Program) -> None:
        self._tab, self.program = tab, program
        self._begin = 0

    @property
    def output(self) -> str:
        """What was printed since the last line was typed."""
        return self.program.output[self._begin :]

    def begin(self, line: str) -> None:
        """Type a line, once there is a prompt."""
        wait_until(lambda: self.PROMPT in self.output, STARTED_WITHIN_S, f"a prompt for {line}")
        self._begin = len(self.program.output)
        self._tab.order({"type": self.program.number, "typed": {"line": line}})

    def type(self, line: str) -> str:
        """Type a line, and return what it prints until the next prompt."""
        self.begin(line)
        wait_until(lambda: self.PROMPT in self.output, STARTED_WITHIN_S, f"the end of {line}")
        return self.ENDED.sub("", self.output.partition(self.PROMPT)[0])

    def wait_for_output(self, text: str) -> None:
        """Wait until the line has printed a text."""
        wait_until(lambda: text in self.output, STARTED_WITHIN_S, f"{text!r} in {self.output!r}")

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self._tab.order({"interrupt": self.program.number})


class PyodideTab:
    """The hub, in a process of Node.js. Use it as a context manager."""

    def __init__(self, files: Path) -> None:
        self._node = subprocess.Popen(
            ["node", str(REPOSITORY / "plugins/pipros-tab/tests/pyodide/tab.mjs"), str(files)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        self._programs: dict[int, Program] = {}
        self._read_files: dict[str, str] = {}
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def start(self, name: str, source: str) -> Program:
        """Start a script with this source."""
        path = f"/home/{name}.py"
        return self._start({"argv": ["python3", path], "files": {path: source}, "env": {}})

    def run(self, *command: str) -> Program:
        """Start a command, such as `rostopic list`."""
        return self._start({"argv": command, "files": {}, "env": {}})

    def terminal(self) -> PyodideTerminal:
        """Open a terminal."""
        return PyodideTerminal(self, self.run("bash"))

    def write(self, path: str, text: str) -> None:
        """Write a file, as the editor does."""
        self.order({"write": path, "text": text})

    def read(self, path: str) -> str:
        """Return a file of the home folder, as the editor shows it."""
        self._read_files.pop(path, None)
        self.order({"read": path})
        wait_until(lambda: path in self._read_files, 60)
        return self._read_files[path]

    def _start(self, program: Mapping[str, Any]) -> Program:
        number = len(self._programs) + 1
        started = self._programs[number] = Program(self, number)
        self.order({"start": program, "as": number})
        return started

    def order(self, order: Mapping[str, Any]) -> None:
        """Send an order to the hub."""
        assert self._node.stdin is not None
        self._node.stdin.write(json.dumps(order) + "\n")
        self._node.stdin.flush()

    def _read(self) -> None:
        assert self._node.stdout is not None
        for line in self._node.stdout:
            event = json.loads(line)
            if "path" in event:
                self._read_files[event["path"]] = event["text"]
                continue
            program = self._programs[event["number"]]
            program.output += event.get("output", "")
            program.code = event.get("code", program.code)

    def __enter__(self) -> PyodideTab:
        return self

    def __exit__(self, *_: object) -> None:
        self._node.kill()
        self._node.wait()
        self._reader.join()
        for pipe in (self._node.stdin, self._node.stdout):
            if pipe is not None:
                pipe.close()
