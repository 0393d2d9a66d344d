"""Commands that read lines, of files or of the output before a `|`: `grep`, `head`, `tail` and `wc`.

Theory of operation. A filter is a generator that gets lines, and None at their end; it returns its exit code.
It runs in the worker that prints: `rostopic echo /chatter | grep data` shows each line at once, and `head`
ends the program before it as a closed pipe does.
"""

from __future__ import annotations

import collections
import contextlib
import getopt
import io
import re
import signal
import sys
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

_Filter = Generator[None, str | None, int]
_Options = Mapping[str, str]
_SWAPPED: Final = re.compile(r"^\*|\\?[|+?(){}]")
"""What basic and Python's regular expressions write with and without a backslash."""


class Pipe(io.TextIOBase):
    """Standard output before a filter. `code` is the filter's exit code once it needs no more lines."""

    def __init__(self, words: Sequence[str], out: Any, file: str = "") -> None:
        """Prepare a filter that prints to `out`. Raises ValueError if an option or the pattern is invalid."""
        self.code: int | None = None
        self._filter = FILTERS[words[0]][0](*_parsed(words), file, out)
        self._rest, self._is_broken = "", False
        self._send(None)  # starts it

    def write(self, text: str) -> int:
        """Pass whole lines on. End a program that goes on printing, as SIGPIPE does."""
        if self.code is not None and text.strip():
            handler = signal.getsignal(signal.SIGINT)
            if self._is_broken and callable(handler):
                handler(signal.SIGINT, None)
            self._is_broken = True
            raise BrokenPipeError
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            self._send(f"{line}\n")
        return len(text)

    def end(self) -> int:
        """Pass the rest on, and return the exit code."""
        if self._rest:
            self._send(self._rest)
        self._send(None)
        return self.code or 0

    def _send(self, line: str | None) -> None:
        if self.code is None:
            try:
                self._filter.send(line)
            except StopIteration as end:
                self.code = end.value
            except BrokenPipeError:  # the next filter needs no more lines
                self.code = 0


def complain(name: str, error: Exception) -> None:
    """Print why a command failed, as bash does."""
    if isinstance(error, OSError):
        name = f"{name}: {error.filename}" if error.filename else "bash"
    print(f"{name}: {getattr(error, 'strerror', None) or error}", file=sys.stderr)


def for_each(name: str, paths: Iterable[str], act: Callable[[str], object]) -> int:
    """Call a function with each path. Report those that fail, and return 1 if there are any."""
    code = 0
    for path in paths:
        try:
            act(path)
        except BrokenPipeError:  # `head` needs no more lines
            raise
        except OSError as error:
            complain(name, error)
            code = 1
    return code


def run_before(filters: Sequence[Sequence[str]], call: Callable[[], int], out: Any) -> int:
    """Call a function whose output passes through filters to `out`. Return the exit code of the last."""
    pipes = [out]
    for words in reversed(filters):
        pipes.insert(0, Pipe(words, pipes[0]))
    with contextlib.redirect_stdout(pipes[0]):
        code = call()
    for pipe in pipes[:-1]:
        code = pipe.end()
    return code


def run_on_files(name: str, arguments: Sequence[str]) -> int:
    """Run a filter on the files that its arguments name. Raises ValueError if there are none."""
    options, operands = _parsed([name, *arguments])
    given = operands[1 if name == "grep" else 0 :]
    files = given
    if "-r" in options:
        found = (file for path in given or ["."] for file in sorted(Path(path).rglob("*")) or [Path(path)])
        files = [str(file) for file in found if not file.is_dir()]
    if not files:
        raise ValueError("files are needed: the terminals of a browser tab pass no lines to commands")
    is_named = len(files) > 1 or "-r" in options or name == "wc"
    words = [name, *map("".join, options.items()), "--", *(operands[:1] if name == "grep" else ())]
    codes = []

    def run(file: str) -> None:
        text = Path(file).read_text(encoding="utf-8", errors="replace")
        pipe = Pipe(words, sys.stdout, file if is_named else "")
        pipe.write(text)
        codes.append(pipe.end())

    if for_each(name, files, run):
        return 2 if name == "grep" else 1
    return min(codes)


def _parsed(words: Sequence[str]) -> tuple[_Options, list[str]]:
    name, *arguments = (re.sub(r"^-(\d+)$", r"-n\1", word) for word in words)
    try:
        options, operands = getopt.gnu_getopt(arguments, FILTERS[name][1])
    except getopt.GetoptError as error:
        raise ValueError(f"invalid option -- '{error.opt}'") from None
    if name == "grep" and not operands:
        raise ValueError("a pattern is needed: grep [-Einrv] PATTERN [FILE]...")
    for _, value in options if name in ("head", "tail") else ():
        if not value.isdigit():
            raise ValueError(f"invalid number of lines: '{value}'")
    return dict(options), operands


def _grep(options: _Options, operands: Sequence[str], file: str, out: Any) -> _Filter:
    pattern = operands[0] if "-E" in options else _SWAPPED.sub(_swapped, operands[0])
    try:
        wanted = re.compile(pattern, re.IGNORECASE if "-i" in options else 0)
    except re.error as error:
        raise ValueError(f"{operands[0]}: {error}") from None
    number = count = 0
    while (line := (yield)) is not None:
        number += 1
        if bool(wanted.search(line.rstrip("\n"))) != ("-v" in options):
            count += 1
            place = (f"{file}:" if file else "") + (f"{number}:" if "-n" in options else "")
            out.write(place + line.rstrip("\n") + "\n")
            out.flush()
    return 0 if count else 1


def _swapped(found: re.Match[str]) -> str:
    return found[0][1] if found[0][0] == "\\" else f"\\{found[0]}"


def _head(options: _Options, _: Sequence[str], file: str, out: Any) -> _Filter:
    out.write(f"==> {file} <==\n" if file else "")
    left = int(options.get("-n", "10"))
    while left and (line := (yield)) is not None:
        left -= 1
        out.write(line)
        out.flush()
    return 0


def _tail(options: _Options, _: Sequence[str], file: str, out: Any) -> _Filter:
    last = collections.deque[str](maxlen=int(options.get("-n", "10")))
    while (line := (yield)) is not None:
        last.append(line)
    out.write((f"==> {file} <==\n" if file else "") + "".join(last))
    return 0


def _wc(options: _Options, _: Sequence[str], file: str, out: Any) -> _Filter:
    counts = {"-l": 0, "-w": 0, "-c": 0}
    while (line := (yield)) is not None:
        counts["-l"] += line.endswith("\n")
        counts["-w"] += len(line.split())
        counts["-c"] += len(line.encode())
    shown = [str(count) for option, count in counts.items() if option in options or not options]
    out.write(" ".join([*shown, *([file] if file else ())]) + "\n")
    return 0


FILTERS: Final[Mapping[str, tuple[Callable[[_Options, Sequence[str], str, Any], _Filter], str]]] = {
    "grep": (_grep, "Einrv"),
    "head": (_head, "n:"),
    "tail": (_tail, "n:"),
    "wc": (_wc, "clw"),
}  # functions, and the letters of their options
