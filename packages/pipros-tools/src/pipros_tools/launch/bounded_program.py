"""Bound the time and the memory of a program of another project, such as xacro, in its own process.

Robot descriptions come from strangers, and an expression such as `${9**9**9}` would otherwise compute for
ever. Python cannot interrupt such an operation itself, so a second process watches.
"""

from __future__ import annotations

import os
import select
import signal
import sys
from contextlib import suppress
from typing import Final

from pipros.basics.limits import limit_text, process_limits

MEMORY_BYTES: Final = 2 * 1024**3
"""Address space of the program. xacro needs a hundredth of it for a large robot."""


def bound_this_process(name: str) -> None:
    """Let this process have `MEMORY_BYTES`, and kill it, with a message, after `launch_command_s`.

    Without `fork`, for example on Windows, nothing is bounded.
    """
    if not hasattr(os, "fork"):
        return
    limit_s = process_limits().launch_command_s
    read_end, write_end = os.pipe()  # this process keeps the write end open until it ends
    watched = os.getpid()
    if os.fork() == 0:
        try:
            os.close(write_end)
            _watch(name, watched, read_end, limit_s)
        finally:
            os._exit(0)
    os.close(read_end)
    _limit_memory()


def _watch(name: str, watched: int, read_end: int, limit_s: float) -> None:
    if sys.platform == "win32":
        return
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)  # whoever reads the program's output must see its end
    if not select.select([read_end], [], [], limit_s)[0]:
        print(
            f"{name}: not done in time, so it was ended: {limit_text('launch_command_s', limit_s)}; "
            "look for an expression or a macro without end",
            file=sys.stderr,
            flush=True,
        )
        os.kill(watched, signal.SIGKILL)


def _limit_memory() -> None:
    if sys.platform == "win32":
        return
    import resource

    limits = resource.getrlimit(resource.RLIMIT_AS)
    lower = [MEMORY_BYTES, *(each for each in limits if each != resource.RLIM_INFINITY)]
    with suppress(OSError, ValueError):  # not every system has this limit
        resource.setrlimit(resource.RLIMIT_AS, (min(lower), limits[1]))
