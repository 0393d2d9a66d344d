"""Processes that other code starts and a launch watches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from pipros.launch.adopted import AdoptedProcesses


@dataclass(eq=False)
class Program:
    name: str
    is_required: bool = False
    exit_code: int | None = None
    delay_s: float | None = None
    is_up: bool = True
    problem: Exception | None = None
    calls: list[str] = field(default_factory=list)

    def has_ended(self) -> bool:
        return not self.is_up

    def restart_delay_s(self) -> float | None:
        return self.delay_s

    def describe_end(self) -> str:
        return "has died"

    def start(self) -> None:
        self.is_up = True
        self.calls.append("start")

    def stop(self, errors: list[str]) -> None:
        self.calls.append("stop")
        self.is_up = False
        if self.problem is not None:
            raise self.problem
        if self.exit_code == -9:
            errors.append(f"{self.name} required SIGKILL")


class Page:
    """Printer that keeps its output."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def say(self, text: str) -> None:
        self.lines.append(text)

    def bold(self, text: str) -> None:
        self.lines.append(f"bold {text}")

    def error(self, text: str) -> None:
        self.lines.append(f"error {text}")


class Watch:
    """Adopted processes, and a record of their ends."""

    def __init__(self, *programs: Program) -> None:
        self.page = Page()
        self.ended: list[tuple[str, int | None]] = []
        self.failures: list[str] = []
        self.on_end: Callable[[], object] = bool
        self.processes = AdoptedProcesses[Program](
            self.page, self._note_end, lambda: self.failures.append("raised")
        )
        for program in programs:
            self.processes.add(program)

    def _note_end(self, name: str, exit_code: int | None) -> None:
        self.ended.append((name, exit_code))
        self.on_end()


def test_an_ended_process_is_reported_and_no_longer_watched() -> None:
    fails, ends, runs = Program("a", exit_code=3, is_up=False), Program("b", is_up=False), Program("c")
    watch = Watch(fails, ends, runs)

    assert watch.processes.check() == [fails, ends]

    assert watch.page.lines == ["error [a] has died", "bold [b] has died"]
    assert watch.ended == [("a", 3), ("b", None)]
    assert list(watch.processes) == [runs]


def test_a_process_may_be_removed_when_its_end_is_reported() -> None:
    program = Program("a", is_up=False)
    watch = Watch(program)
    watch.on_end = lambda: watch.processes.remove(program)

    assert watch.processes.check() == [program]

    assert list(watch.processes) == []


def test_a_process_is_restarted_when_its_delay_is_over() -> None:
    program = Program("a", delay_s=1.0, is_up=False)
    watch = Watch(program)

    assert watch.processes.check() == []
    assert watch.page.lines == []
    program.delay_s = -0.1
    assert watch.processes.check() == []

    assert program.calls == ["stop", "start"]
    assert watch.page.lines[-1] == "[a] restarting process"
    assert list(watch.processes) == [program]


def test_the_end_of_a_required_process_stops_the_launch() -> None:
    watch = Watch(Program("a", is_required=True, is_up=False))

    assert watch.processes.check() is None

    assert "REQUIRED process [a] has died!" in watch.page.lines[0]


def test_processes_end_in_reverse_order_and_core_processes_last() -> None:
    watch = Watch(Program("a"), Program("b", exit_code=-9))
    watch.processes.add(Program("core"), stop_last=True)
    watch.processes.add(Program("c", problem=RuntimeError("no")))

    watch.processes.end()

    assert [line.partition("]")[0] for line in watch.page.lines[:4]] == ["[c", "[b", "[a", "[core"]
    assert watch.page.lines[4:] == ["error Shutdown errors:\n * b required SIGKILL"]
    assert watch.failures == ["raised"]
    assert list(watch.processes) == []
