"""How processes are ended, step by step, and how their ends are reported."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from signal import Signals
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_tools.launch.process import SIGINT, SIGKILL, SIGTERM
from pipros_tools.launch.terminate import end, report_end


class FakeProcess:
    """Ends on one of the signals. With `leaves`, its group exists until that signal."""

    def __init__(self, name: str, ends_on: Signals | None = SIGINT, leaves: Signals | None = None) -> None:
        self.name = name
        self.pid = 100
        self.signals: list[Signals] = []
        self.exit_code: int | None = None
        self.command = SimpleNamespace(argv=("/bin/n", "arg"))
        self.stdout_log: Path | None = None
        self.stderr_log: Path | None = None
        self.is_released = False
        self._ends_on = ends_on
        self._leaves = leaves

    @property
    def has_group(self) -> bool:
        return self.exit_code is None or (self._leaves is not None and self._leaves not in self.signals)

    def send_signal(self, number: Signals) -> None:
        self.signals.append(number)
        if number == self._ends_on:
            self.exit_code = -number

    def release(self) -> None:
        self.is_released = True


class Recorder:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.errors: list[str] = []

    def say(self, text: str) -> None:
        self.lines.append(text)

    bold = say

    def error(self, text: str) -> None:
        self.errors.append(text)


def end_all(*processes: FakeProcess, **timeouts: float) -> tuple[Recorder, list[float]]:
    """End the processes; return the output and the timeouts of the steps."""
    console, waits = Recorder(), []

    def await_ends(left: Sequence[Any], timeout_s: float) -> list[Any]:
        waits.append(timeout_s)
        return [process for process in left if process.exit_code is None]

    arguments: Any = (processes, console, await_ends)
    end(*arguments, sigint_timeout_s=15, sigterm_timeout_s=2, **timeouts)
    return console, waits


@pytest.mark.needs("SIGKILL")
def test_all_processes_get_sigint_and_only_remaining_ones_stronger_signals() -> None:
    polite, stubborn, deaf = FakeProcess("a-1"), FakeProcess("b-2", SIGTERM), FakeProcess("c-3", SIGKILL)
    console, waits = end_all(polite, stubborn, deaf)
    assert (polite.signals, stubborn.signals) == ([SIGINT], [SIGINT, SIGTERM])
    assert (deaf.signals, waits[:2]) == ([SIGINT, SIGTERM, SIGKILL], [15, 2])
    assert console.lines == [f"[{name}] killing on exit" for name in ("a-1", "b-2", "c-3")]
    assert console.errors == [
        "[b-2] escalating to SIGTERM",
        "[c-3] escalating to SIGTERM",
        "[c-3] escalating to SIGKILL",
        "Shutdown errors:\n * process[c-3, pid 100]: required SIGKILL.",
    ]


def test_children_of_an_ended_process_are_ended_and_released() -> None:
    shell = FakeProcess("a-1", leaves=SIGTERM)
    end_all(shell)
    assert shell.signals == [SIGINT, SIGTERM]
    assert shell.is_released


def test_a_process_that_survives_sigkill_is_not_waited_for() -> None:
    immortal = FakeProcess("a-1", None)
    end_all(immortal, left_behind_timeout_s=0.01)
    assert immortal.exit_code is None


def report(process: FakeProcess, *, is_required: bool = False) -> Recorder:
    console = Recorder()
    arguments: Any = (process, "/log/n-1", console)
    report_end(*arguments, is_required=is_required)
    return console


def test_a_clean_exit_is_reported_with_noetics_text() -> None:
    process = FakeProcess("n-1")
    process.exit_code = 0
    console = report(process)
    assert console.lines == ["[n-1] process has finished cleanly\nlog file: /log/n-1*.log"]
    assert console.errors == []


def test_a_process_that_died_is_quoted_with_its_last_output(tmp_path: Path) -> None:
    process = FakeProcess("n-1")
    process.exit_code = 1
    process.stdout_log = tmp_path / "stdout.log"
    process.stdout_log.write_text("hello\nno such file\n")
    death, quote = report(process).errors
    assert death == (
        "[n-1] process has died [pid 100, exit code 1, cmd /bin/n arg].\nlog file: /log/n-1*.log"
    )
    assert quote == "[n-1] its last output:\n[n-1]   hello\n[n-1]   no such file"


def test_an_error_log_is_quoted_before_standard_output(tmp_path: Path) -> None:
    process = FakeProcess("n-1")
    process.exit_code = 1
    for name in ("stdout", "stderr"):
        (tmp_path / name).write_text(f"from {name}\n")
    process.stdout_log, process.stderr_log = tmp_path / "stdout", tmp_path / "stderr"
    assert report(process).errors[1].endswith("from stderr")
    process.stderr_log.write_text("")
    assert report(process).errors[1].endswith("from stdout")


def test_the_end_of_a_required_process_is_highlighted() -> None:
    process = FakeProcess("n-1")
    process.exit_code = 0
    [text] = report(process, is_required=True).errors
    assert text.startswith("=" * 80 + "REQUIRED process [n-1] has died!\nprocess has finished cleanly")
    assert text.endswith("Initiating shutdown!\n" + "=" * 80)
