"""A program that matches names with regular expressions; `NamePatterns` runs it as a child process.

Each input line is a JSON list `[pattern, name]`; each output line is true, false, null (timed out), or the
reason the pattern is invalid. This program imports only the standard library.
"""

from __future__ import annotations

import json
import re
import signal
import sys

TIME_LIMIT_S = 0.1
"""Maximum processor time for one pattern and one name. Usually, a few microseconds are enough."""


class _MatchingTimeout(Exception):
    """Raised by the signal handler, which Python runs even while `re` is matching."""


def _end_match(*_: object) -> None:
    raise _MatchingTimeout


def _answer(pattern: str, name: str) -> bool | str | None:
    # Limit processor time instead of elapsed time, because a busy machine may suspend the process.
    if sys.platform != "win32":
        signal.signal(signal.SIGPROF, _end_match)
        signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT_S)
    try:
        return re.compile(pattern).fullmatch(name) is not None
    except (re.error, RecursionError, OverflowError, MemoryError) as error:
        return str(error) or type(error).__name__
    finally:
        if sys.platform != "win32":
            signal.setitimer(signal.ITIMER_PROF, 0)


def main() -> None:
    """Respond to requests until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for line in sys.stdin:
        try:
            answer = _answer(*json.loads(line))
        except _MatchingTimeout:
            answer = None
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
