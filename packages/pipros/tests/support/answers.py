"""Cached output of genuine ROS commands, for commands that depend only on files and environment variables.

Starting such a command takes half a second of processor time, and its output does not change.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.support.genuine import is_required
from tests.support.once import machine_folder, make_once
from tests.support.ros import Side

_INSTALLED = Path("/var/lib/dpkg/status")  # the installed packages with their versions
_HOME = "/the/home/of/the/test"
_MASTER = "http://the.master.of.the.test:11311"
_OF_A_RUN = ("PIPROS_TEST_RUN", "ROS_MASTER_URI")
_FORGETFUL = {"rospack", "rosstack"}
"""Genuine programs that test whether they are quiet before they have set it, when words on the command line
are too many: about one run in four ends without its error message, by what the memory held before."""
_RUNS = 30


@dataclass(frozen=True, slots=True)
class Answer:
    """The exit code and output lines of a program."""

    returncode: int
    stdout: list[str]
    stderr: list[str]

    @property
    def output(self) -> str:
        return "\n".join((*self.stdout, *self.stderr))


def ask(
    side: Side, *argv: str | Path, cwd: Path | None = None, timeout_s: float = 60.0, **more: str
) -> Answer:
    """Return the output of a program that uses no master and changes no files.

    For genuine ROS, the output is cached. The key consists of the arguments, the environment variables, the
    files below the test's home and the installed Debian packages. The URI of the test's master is not part of
    the key; if it occurs in the cached output, it is replaced by the current one. In continuous integration,
    nothing is cached.

    Args:
        cwd: the working directory; defaults to the test's home.
        more: additional environment variables.
    """
    words, folder = [str(word) for word in argv], cwd or side.home

    def run(attempts: int = _RUNS) -> Answer:
        ended = side.processes.run(*words, cwd=folder, timeout_s=timeout_s, environment=more)
        assert ended.returncode is not None
        is_silent = ended.returncode and not ended.stdout and not ended.stderr
        if is_silent and side.is_genuine and words[0] in _FORGETFUL and "-q" not in words and attempts > 1:
            return run(attempts - 1)
        return Answer(ended.returncode, ended.stdout, ended.stderr)

    if not side.is_genuine or is_required():
        return run()
    environment = {**side.environment, **more}
    variables = {name: value for name, value in environment.items() if name not in _OF_A_RUN or name in more}
    question = json.dumps([words, str(folder), variables, dict(_files(side.home))], sort_keys=True)
    own = {str(side.home): _HOME, side.environment.get("ROS_MASTER_URI", _MASTER): _MASTER}
    digest = hashlib.sha256(_replaced(question, own).encode()).hexdigest()
    kept = _answers() / f"{digest}.json"
    if not kept.exists():
        text = json.dumps(asdict(run()))
        written = kept.with_suffix(f".{os.getpid()}")
        written.write_text(_replaced(text, own))
        written.replace(kept)
    return Answer(**json.loads(_replaced(kept.read_text(), {common: ours for ours, common in own.items()})))


def _replaced(text: str, changes: dict[str, str]) -> str:
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


def _files(home: Path) -> Iterator[tuple[str, str]]:
    """Yield the path of each file below the home, with its mode and digest, except logs and bytecode."""
    for file in sorted(home.rglob("*")):
        place = file.relative_to(home)
        if file.is_file() and place.parts[0] != ".ros" and file.suffix != ".pyc":
            content = file.read_bytes().replace(str(home).encode(), _HOME.encode())
            yield str(place), f"{file.stat().st_mode:o} {hashlib.sha256(content).hexdigest()}"


@functools.cache
def _answers() -> Path:
    return make_once(machine_folder("answers", (_INSTALLED, Path(__file__))), lambda: None)
