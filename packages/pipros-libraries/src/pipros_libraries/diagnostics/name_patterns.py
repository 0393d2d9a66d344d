"""Match untrusted regular expressions with a time limit.

Python's `re` may need exponential time: matching 40 characters with `(a+)+$` takes days. Meanwhile, no other
thread of the process can run. Therefore, a child process does the matching, and gives up after a tenth of a
second of processor time. Results are cached, so a pattern is rarely matched twice with the same name.

The alternatives are worse. A check for nested quantifiers misses `a?a?a?…aaa` and rejects `(left|right)*`. A
linear-time matcher (RE2) would be a compiled dependency, and lacks look-ahead and back references.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any

from pipros.basics.posix import NEW_GROUP
from pipros.basics.windows import ON_WINDOWS

PATTERN_CHARACTERS = 1_000
"""Maximum length of a pattern."""

NAME_CHARACTERS = 300
"""Maximum length of a name that can match a pattern."""

SLOW_LIMIT = 20
"""Number of slow patterns at which the process stops using patterns."""

CACHED = 10_000
"""Maximum number of cached results."""

_DEADLINE_S = 3.0 if ON_WINDOWS else 30.0
"""Maximum time to wait for a response, in case the machine is too busy to run the child; on Windows, also the
limit for a pattern.
"""

_PROGRAM = Path(__file__).with_name("match_names.py")


class NamePatterns:
    """The patterns of one analyzer. Thread-safe.

    Attributes:
        slow: the patterns that took too long and are no longer used.
    """

    def __init__(self, patterns: Sequence[str]) -> None:
        """Check the patterns.

        Raises:
            ValueError: a pattern is not a regular expression, or is too long.
        """
        for pattern in patterns:
            if len(pattern) > PATTERN_CHARACTERS:
                raise ValueError(
                    f"a pattern must have at most {PATTERN_CHARACTERS} characters, got {len(pattern)}"
                )
            reason = _child().ask(pattern, "")
            if isinstance(reason, str):
                raise ValueError(reason)
        self._patterns = tuple(patterns)
        self.slow: list[str] = []

    def __bool__(self) -> bool:
        return bool(self._patterns)

    def match(self, name: str) -> bool:
        """Return whether any pattern matches the whole name.

        Names longer than `NAME_CHARACTERS` never match.
        """
        if len(name) > NAME_CHARACTERS:
            return False
        for pattern in self._patterns:
            result = None if pattern in self.slow else _child().ask(pattern, name)
            if result is True:
                return True
            if result is None and pattern not in self.slow:
                self.slow.append(pattern)
        return False


class _Child:
    """The child process. It is started by the first request and ends with this process."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._cached: dict[tuple[str, str], Any] = {}
        self._slow: set[str] = set()
        self._lock = threading.Lock()
        atexit.register(self.close)

    def ask(self, pattern: str, name: str) -> bool | str | None:
        """Return whether the pattern matches the whole name.

        Return the error text if the pattern is invalid. Return None if matching took too long, now or in an
        earlier call, if `SLOW_LIMIT` patterns took too long, or if the child died.
        """
        with self._lock:
            if pattern in self._slow or len(self._slow) >= SLOW_LIMIT:
                return None
            key = pattern, name
            if key not in self._cached:
                if len(self._cached) >= CACHED:
                    self._cached.clear()
                self._cached[key] = self._answer(pattern, name)
            answer: bool | str | None = self._cached[key]
            if answer is None:
                self._slow.add(pattern)
            return answer

    def close(self) -> None:
        """Terminate the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for pipe in _pipes(process):
                with contextlib.suppress(OSError):  # closing fails if buffered data cannot be written
                    pipe.close()

    def _answer(self, pattern: str, name: str) -> Any:
        process = self._process = self._process or _start()
        writing, reading = _pipes(process)
        end = threading.Timer(_DEADLINE_S, process.kill)
        end.daemon = True
        try:
            end.start()
            writing.write(json.dumps([pattern, name]).encode() + b"\n")
            writing.flush()
            return json.loads(reading.readline())
        except (OSError, ValueError, RuntimeError):  # the child was killed, or this process is ending
            self.close()
            return None
        finally:
            end.cancel()


def _start() -> subprocess.Popen[bytes]:
    return subprocess.Popen(  # noqa: S603
        [sys.executable, "-I", "-S", str(_PROGRAM)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C should not reach the child, which exits at the end of its input
        creationflags=NEW_GROUP,
    )


def _pipes(process: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes]]:
    assert process.stdin is not None  # noqa: S101 # both are pipes
    assert process.stdout is not None  # noqa: S101
    return process.stdin, process.stdout


@cache
def _child() -> _Child:
    return _Child()
