import io
from collections.abc import Sequence
from pathlib import Path
from signal import Signals
from types import SimpleNamespace
from typing import Any

import pytest

from pipros_tools.launch.command import NodeCommand
from pipros_tools.launch.guardian import read_groups
from pipros_tools.launch.managed_node import ManagedNode, ProcessInfo
from pipros_tools.launch.model import LaunchError, LaunchNode, Output
from pipros_tools.launch.process import SIGINT, SIGKILL, SIGTERM, last_lines
from pipros_tools.launch.run_options import RunOptions
from pipros_tools.launch.terminate import end, report_end


def process(*, exit_code: int | None = None, has_group: bool = False) -> Any:
    return SimpleNamespace(pid=4711, exit_code=exit_code, has_group=has_group)


@pytest.fixture
def managed() -> ManagedNode:
    command = NodeCommand(("/bin/talker", "x"), {"PATH": "/bin", "A": "1"}, {"A": "1"}, Path("/"))
    node = LaunchNode("talkers", "talker", "n", respawn=True, respawn_delay_s=2.5)
    return ManagedNode("n-1", node, command, Output.LOG, 1)


def test_a_running_process_is_described_under_noetics_names(managed: ManagedNode) -> None:
    managed.process = managed.latest = process()
    managed.spawn_count = 2
    assert managed.info().as_struct() == {
        "name": "n-1", "package": "talkers", "pid": 4711, "alive": True, "spawn_count": 2,
        "args": ["/bin/talker", "x"], "env": {"A": "1"}, "respawn": True, "respawn_delay": 2.5,
        "required": False, "log_output": True,
    }  # fmt: skip


def test_a_process_that_has_ended_has_an_exit_code() -> None:
    ended = ProcessInfo("n-1", LaunchNode("p", "t", "n"), 1, -2, 1, arguments=(), environment={})
    assert not ended.is_alive
    assert ended.as_struct()["exit_code"] == -2


def test_a_node_is_done_when_it_neither_runs_nor_respawns(managed: ManagedNode) -> None:
    assert managed.is_done
    managed.process = process()
    assert not managed.is_done
    managed.process, managed.restart_at = None, 5.0
    assert not managed.is_done
    managed.restart_at, managed.left_behind = None, process(exit_code=0, has_group=True)
    assert not managed.is_done
    managed.left_behind = process(exit_code=0)
    assert managed.is_done
    assert managed.left_behind is None


@pytest.mark.parametrize("name", ["sigint_timeout_s", "sigterm_timeout_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_timeouts_are_positive(name: str, value: float) -> None:
    with pytest.raises(LaunchError, match="must be a positive number, received"):
        RunOptions(**{name: value})  # type: ignore[arg-type]


def test_the_last_lines_of_a_file_are_not_blank(tmp_path: Path) -> None:
    file = tmp_path / "log"
    file.write_text("x" * 10_000 + "\n" + "\n".join(f"line {number}" for number in range(9)) + "\n\n \n")
    assert (last_lines(file, 2), last_lines(tmp_path / "none")) == (["line 7", "line 8"], [])


def test_the_guardian_knows_which_groups_are_left() -> None:
    lines = io.StringIO("+10\n+11\n+12\n-11\n+1\n+0\n+-5\ngarbage\n+13")
    assert read_groups(lines) == {10, 12, 13}


# How processes are ended, step by step, and how their ends are reported.


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
        "[b-2] escalating to SIGTERM", "[c-3] escalating to SIGTERM", "[c-3] escalating to SIGKILL",
        "Shutdown errors:\n * process[c-3, pid 100]: required SIGKILL.",
    ]  # fmt: skip


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
