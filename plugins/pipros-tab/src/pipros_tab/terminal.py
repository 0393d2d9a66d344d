"""A terminal of a tab: reads lines, runs them, and starts their programs in further workers.

The page shows the output, which also has marks: escape sequences `ESC ] 133 ; LETTER ; TEXT BEL`. With P,
the terminal is ready, and the text is the prompt. D has a line that succeeded. C has a typed line, the line
completed, and the words that may end it (JSON). E opens a file in the editor. After K, the program that runs
gets each key.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import signal
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from math import inf
from pathlib import Path
from typing import Any

import yaml

from pipros.safe.yaml import load
from pipros_tab import shell
from pipros_tab.files import SharedFiles
from pipros_tab.network import Network
from pipros_tab.processes import TabProcess
from pipros_tab.turns import WorkerTurns

INTERRUPTED = 130
_EDITORS = ("code", "edit", "gedit", "nano", "vim")

_TEMPLATE = "\x1f"
"""Begins a completion that is a message template of several lines."""


class Terminal:
    """One terminal."""

    def __init__(self, network: Network, turns: WorkerTurns, files: SharedFiles) -> None:
        self._network, self._turns, self._files = network, turns, files
        self._foreground: TabProcess | None = None
        self._jobs: list[tuple[int, TabProcess, str]] = []
        self._is_over = False
        for name in _EDITORS:
            shell.BUILT_IN[name] = _edit
        shell.BUILT_IN.update(exit=self._exit, jobs=self._list_jobs, kill=self._kill, rosed=edit_in_package)

    def run(self) -> int:
        """Run lines until `exit`."""
        signal.signal(signal.SIGINT, lambda *_: self._interrupt())
        if os.path.isfile(os.path.expanduser("~/.bashrc")):
            shell.run_line("source ~/.bashrc", self._start)
        while not self._is_over:
            self._report_ended()
            _mark("P", _prompt())
            typed = self._next()
            if "line" in typed:
                if shell.run_line(typed["line"], self._start) == 0:
                    _mark("D", typed["line"])
                self._files.push()
        return 0

    def _next(self) -> dict[str, str]:
        """Wait for a line, and complete words meanwhile."""
        while True:
            self._turns.wait(lambda: bool(self._network.typed), None)
            typed = dict(self._network.typed.popleft())
            if "complete" in typed:
                words = completions(line := typed["complete"])
                answer = {"typed": line, "completed": completed(line, words), "words": words}
                _mark("C", json.dumps(answer))
            elif "stop" not in typed:
                return typed

    def _interrupt(self) -> None:
        if self._foreground is not None:
            self._foreground.send_signal(signal.SIGINT)

    def _start(self, words: list[str], output: str | None = None, *, waits: bool = True, **more: Any) -> int:
        """Start a program, and wait for its end unless it runs in the background."""
        sys.stdout.flush()
        self._files.push()
        with open(output or os.devnull, "a", encoding="utf-8") as file:
            process = TabProcess(words, stdout=file if output else None, **more)
        if not waits:
            number = max((each[0] for each in self._jobs), default=0) + 1
            self._jobs.append((number, process, " ".join(words)))
            print(f"[{number}] {process.pid}", flush=True)
            return 0
        self._foreground = process
        self._turns.wait(lambda: process.poll() is not None or self._stop_if_typed(process), None)
        self._foreground = None
        return process.wait()

    def _stop_if_typed(self, process: TabProcess) -> bool:
        typed = self._network.typed
        if typed and "stop" in typed[0]:
            typed.popleft()
            process.kill()
        return False

    def _report_ended(self) -> None:
        for job in list(self._jobs):
            number, process, line = job
            if process.poll() is not None:
                self._jobs.remove(job)
                print(f"[{number}]+  {_state(process):<23} {line}", flush=True)

    def _exit(self, _: Sequence[str]) -> int:
        self._is_over = True
        return 0

    def _list_jobs(self, _: Sequence[str]) -> int:
        for number, process, line in self._jobs:
            print(f"[{number}]  {_state(process):<23} {line} &")
        return 0

    def _kill(self, words: Sequence[str]) -> int:
        """Send SIGINT, or SIGKILL with -9, to jobs (`%1`) or numbers of processes started here."""
        number = 9 if "-9" in words else signal.SIGINT
        code = 0
        for word in words:
            if word.startswith("-"):
                continue
            found = [job for job in self._jobs if word in (f"%{job[0]}", str(job[1].pid))]
            if not found:
                print(f"bash: kill: {word}: no such job", file=sys.stderr)
                code = 1
            for _, process, _line in found:
                process.send_signal(number)
        return code


def completions(text: str) -> list[str]:
    """Return the words that may stand in place of the last word of a line."""
    words = re.split("[;&]", text)[-1].split(" ")
    started = words[-1]
    words = [word for word in words[:-1] if word] + [started]
    if len(words) == 1 and "/" not in started:
        names = {each.name for each in entry_points(group="console_scripts")} | shell.BUILT_IN.keys()
        return sorted(name for name in names if name.startswith(started))
    found: list[str] = []
    if words[0] not in shell.BUILT_IN:
        (command,) = {*entry_points(group="console_scripts", name="pipros-complete")}
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            command.load()([str(len(words) - 1), *words])
        found = printed.getvalue().splitlines()
        if printed.getvalue().startswith(_TEMPLATE):
            found = [_on_one_line(printed.getvalue())]
    return sorted(set(found)) or _paths(started)


def completed(text: str, words: Sequence[str]) -> str:
    """Complete the last word of a line as far as all words agree."""
    common = os.path.commonprefix(list(words))  # noqa: RUF071 - letters, not parts of paths
    if not common:
        return text
    end = " " if len(words) == 1 and not common.endswith(("/", "=")) else ""
    return f"{text[: text.rfind(' ') + 1]}{common}{end}"


def _on_one_line(template: str) -> str:
    """Return a quoted message template of several lines on one line, because an entry has only one."""
    fields = load(template.strip(f'{_TEMPLATE}"\n'))
    return f'"{yaml.safe_dump(fields, default_flow_style=True, sort_keys=False, width=inf).strip()}"'


def _paths(started: str) -> list[str]:
    folder, name = os.path.split(started)
    place = Path(os.path.expanduser(folder or "."))
    if not place.is_dir():
        return []
    return sorted(
        os.path.join(folder, each.name) + ("/" if each.is_dir() else "")
        for each in place.iterdir()
        if each.name.startswith(name) and (name.startswith(".") or not each.name.startswith("."))
    )


def _state(process: TabProcess) -> str:
    code = process.poll()
    if code is None:
        return "Running"
    return "Done" if code == 0 else f"Exit {code}"


def _prompt() -> str:
    folder, home = os.getcwd(), os.path.expanduser("~")
    return f"student@tab:{folder.replace(home, '~', 1) if folder.startswith(home) else folder}$ "


def _edit(words: Sequence[str]) -> int:
    if not words:
        print("Usage: edit FILE", file=sys.stderr)
        return 1
    _mark("E", os.path.abspath(words[0]))
    return 0


def edit_in_package(words: Sequence[str]) -> int:
    """Open a file in the editor by package and name, as `rosed` does."""
    path = shell.file_in_package(words, "rosed")
    return _edit([path]) if path else 1


def _mark(letter: str, text: str) -> None:
    sys.stdout.write(f"\033]133;{letter};{text}\007")
    sys.stdout.flush()
