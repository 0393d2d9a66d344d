"""Run one command line of a tab: a script, a module, or a command of the installed distributions."""

from __future__ import annotations

import os
import platform
import re
import runpy
import signal
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import entry_points
from types import FrameType
from typing import NoReturn

from pipros_tab.processes import ONLY_PYTHON
from pipros_tab.tab_socket import NO_LINES

INTERRUPTED = 130
NOT_FOUND = 127
CANNOT_RUN = 126
_OWN_FILES = re.compile(r"/pipros_tab/|/pipros_tools/cli/|<frozen |/runpy\.py$|^<string>$")
"""Files whose lines a traceback leaves out above the user's program."""


class Replaced(BaseException):
    """The program asked for another to take its place, as `rosrun` does."""

    def __init__(self, words: Sequence[str], environment: Mapping[str, str]) -> None:
        self.words, self.environment = list(words), dict(environment)


def run_words(words: Sequence[str]) -> int:
    """Run a program, and those that take its place. Return the exit code of the last."""
    while True:
        try:
            return code_of(lambda: _run_command(words))  # noqa: B023 # called at once
        except Replaced as new:
            words = new.words
            os.environ.clear()
            os.environ.update(new.environment)
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _run_command(words: Sequence[str]) -> None:
    """Run a script, or a command of the installed distributions.

    Raises:
        SystemExit: the command does not exist, or the program has exited.
    """
    sys.path[:0] = [each for each in os.environ.get("PYTHONPATH", "").split(os.pathsep) if each]
    named = _without_interpreter(words)
    has_interpreter = len(named) < len(words)
    if not named:
        _refuse("python3: a browser tab has no interactive Python; write a file, and run it", CANNOT_RUN)
    sys.argv = list(named)
    name = sys.argv[0]
    if has_interpreter and name in ("-V", "--version"):
        print(f"Python {platform.python_version()}")
    elif has_interpreter and name == "-m" and len(named) > 1:
        sys.path.insert(0, os.getcwd())
        sys.argv = sys.argv[1:]
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    elif has_interpreter and name == "-c" and len(named) > 1:
        sys.path.insert(0, "")
        sys.argv = [name, *named[2:]]
        exec(compile(named[1], "<string>", "exec"), {"__name__": "__main__"})  # noqa: S102 # as Python does
    elif has_interpreter or "/" in name:
        if not os.path.isfile(name):
            _refuse(f"bash: {name}: No such file or directory", NOT_FOUND)
        if not has_interpreter:
            _check_script(name)
        sys.path.insert(0, os.path.dirname(os.path.abspath(name)))
        runpy.run_path(name, run_name="__main__")
    else:
        if name in (commands := entry_points(group="console_scripts")).names:
            sys.exit(commands[name].load()())
        from pipros.basics.similar_names import similar_names
        from pipros.packages.well_known import why_no_command

        why = why_no_command(name) or f"command not found. {similar_names(name, commands.names)}"
        _refuse(f"{name}: {why.removesuffix('. ')}", NOT_FOUND)


def _without_interpreter(words: Sequence[str]) -> Sequence[str]:
    if os.path.basename(words[0]) == "env" and len(words) > 1:
        words = words[1:]
    if not re.fullmatch(r"python[\d.]*", os.path.basename(words[0])):
        return words
    return words[2:] if words[1:2] == ["-u"] else words[1:]


def _check_script(path: str) -> None:
    """Check that the system could start a file, and that it is Python.

    Raises:
        SystemExit: it is not.
    """
    if not os.stat(path).st_mode & 0o111:
        _refuse(f"bash: {path}: Permission denied. Make it a program: chmod +x {path}", CANNOT_RUN)
    with open(path, "rb") as file:
        first_line = file.readline(256)
    if path.endswith(".py") and not first_line.startswith(b"#!"):
        _refuse(f"bash: {path}: its first line must be #!/usr/bin/env python3", CANNOT_RUN)
    if b"python" not in first_line:
        _refuse(f"bash: {path}: {ONLY_PYTHON}", CANNOT_RUN)


def _refuse(reason: str, code: int) -> NoReturn:
    print(reason, file=sys.stderr)
    raise SystemExit(code)


def _is_exactly(error: BaseException, kind: type) -> bool:
    return type(error) is kind


def _is_own(frame: FrameType) -> bool:
    is_program = frame.f_globals.get("__name__") == "__main__"
    return not is_program and bool(_OWN_FILES.search(frame.f_code.co_filename))


def code_of(call: Callable[[], object]) -> int:
    """Return the exit code that Python would have after a call."""
    try:
        call()
    except Replaced:
        raise
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        print(end.code, file=sys.stderr)
        return 1
    except BaseException as error:
        frames = error.__traceback__
        while frames is not None and _is_own(frames.tb_frame):
            frames = frames.tb_next
        home = os.path.expanduser("~")
        if str(error) == NO_LINES and not any(home in each.filename for each in traceback.extract_tb(frames)):
            print(error, file=sys.stderr)  # a program of pipros
            return 1
        traceback.print_exception(type(error), error, frames)
        ends_by_ctrl_c = isinstance if sys.version_info >= (3, 14) else _is_exactly
        return INTERRUPTED if ends_by_ctrl_c(error, KeyboardInterrupt) else 1
    return 0
