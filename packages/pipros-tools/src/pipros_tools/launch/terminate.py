"""Stops processes with increasingly forceful signals, and reports how they exited."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from pipros.basics.interruptible_wait import wait_in_slices
from pipros_tools.launch.console import Console
from pipros_tools.launch.guardian import SIGKILL
from pipros_tools.launch.process import SIGINT, SIGTERM, NodeProcess, last_lines
from pipros_workspace.python2 import python2_advice

SIGINT_TIMEOUT_S = 15.0
SIGTERM_TIMEOUT_S = 2.0

_SIGKILL_TIMEOUT_S = 2.0
_LEFT_BEHIND_TIMEOUT_S = 1.0
_CHECK_EVERY_S = 0.01

AwaitEnds = Callable[[Sequence[NodeProcess], float], list[NodeProcess]]
"""Function that waits a number of seconds for processes to exit, and returns those still running."""


def end(
    processes: Sequence[NodeProcess],
    console: Console,
    await_ends: AwaitEnds,
    *,
    sigint_timeout_s: float = SIGINT_TIMEOUT_S,
    sigterm_timeout_s: float = SIGTERM_TIMEOUT_S,
    left_behind_timeout_s: float = _LEFT_BEHIND_TIMEOUT_S,
    is_announced: bool = True,
) -> None:
    """Stop processes and their child processes in parallel, with SIGINT, then SIGTERM, then SIGKILL.

    Return when all have exited, or when even SIGKILL had no effect.
    """
    for process in processes:
        if is_announced:
            console.say(f"[{process.name}] killing on exit")
        process.send_signal(SIGINT)
    left = await_ends(processes, sigint_timeout_s)
    errors = []
    for number, timeout_s in ((SIGTERM, sigterm_timeout_s), (SIGKILL, _SIGKILL_TIMEOUT_S)):
        for process in left:
            console.error(f"[{process.name}] escalating to {number.name}")
            process.send_signal(number)
            if number is SIGKILL:
                errors.append(f" * process[{process.name}, pid {process.pid}]: required SIGKILL.")
        if left:
            left = await_ends(left, timeout_s)
    _end_left_behind(processes, left_behind_timeout_s)
    if errors:
        console.error("Shutdown errors:\n" + "\n".join(errors))


def _end_left_behind(processes: Sequence[NodeProcess], timeout_s: float) -> None:
    """Stop child processes that were left running by processes that have exited.

    Starts with SIGTERM, because shells make their background jobs ignore SIGINT.
    """
    left = [process for process in processes if process.has_group]
    for process in left:
        process.send_signal(SIGTERM)
    deadline = time.monotonic() + timeout_s
    while any(process.has_group for process in left) and time.monotonic() < deadline:
        time.sleep(_CHECK_EVERY_S)
    for process in processes:
        process.release()


def report_end(process: NodeProcess, log_stem: str, console: Console, *, is_required: bool) -> None:
    """Report how a process exited, with Noetic's text. If it failed, also print its last output."""
    log = f"log file: {log_stem}*.log"
    if process.exit_code == 0:
        text = f"process has finished cleanly\n{log}"
    else:
        command = " ".join(process.command.argv)
        text = f"process has died [pid {process.pid}, exit code {process.exit_code}, cmd {command}].\n{log}"
    if is_required:
        rule = "=" * 80
        console.error(
            f"{rule}REQUIRED process [{process.name}] has died!\n{text}\nInitiating shutdown!\n{rule}"
        )
    elif process.exit_code == 0:
        console.bold(f"[{process.name}] {text}")
    else:
        console.error(f"[{process.name}] {text}")
    if process.exit_code == 0:
        return
    # The error log is read first, because it was not shown on a terminal.
    logs = [log for log in (process.stderr_log, process.stdout_log) if log is not None]
    lines: list[str] = next(filter(None, map(last_lines, logs)), [])
    if lines:
        shown = "\n".join(f"[{process.name}]   {line}" for line in lines)
        console.error(f"[{process.name}] its last output:\n{shown}")
    for word in process.command.argv[:2]:  # the script may be preceded by its interpreter
        advice = python2_advice(word) if word.endswith(".py") else None
        if advice is not None:
            console.error(f"[{process.name}] {advice}")


def await_exits(processes: Sequence[NodeProcess], timeout_s: float) -> list[NodeProcess]:
    """Wait for processes to exit without consuming their events. Return those still running."""
    deadline = time.monotonic() + timeout_s
    return [
        process
        for process in processes
        if not wait_in_slices(process.wait, max(0.0, deadline - time.monotonic()))
    ]
