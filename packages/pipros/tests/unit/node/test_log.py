"""Log lines: Noetic's format, streams and colours, and the location of the caller."""

from __future__ import annotations

import io
import logging
import sys
from pathlib import Path

import pytest

from pipros.node.clock import SimulatedClock, WallClock
from pipros.node.log import ConsoleHandler, Severity, log_file, logger_levels, set_logger_level


def record(level: int, text: str = "hello") -> logging.LogRecord:
    made = logging.LogRecord("rosout", level, "/code/talker.py", 7, text, (), None, "talk")
    made.created = 1795144503.366333
    return made


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def console(line_format: str | None = None, clock: SimulatedClock | None = None) -> ConsoleHandler:
    return ConsoleHandler("/talker_node", lambda: clock or WallClock(), line_format)


@pytest.mark.parametrize(
    ("level", "stream", "line"),
    [
        (logging.DEBUG, "stdout", "[DEBUG] [1795144503.366333]: hello\n"),
        (logging.INFO, "stdout", "[INFO] [1795144503.366333]: hello\n"),
        (logging.WARNING, "stderr", "[WARN] [1795144503.366333]: hello\n"),
        (logging.ERROR, "stderr", "[ERROR] [1795144503.366333]: hello\n"),
        (logging.CRITICAL, "stderr", "[FATAL] [1795144503.366333]: hello\n"),
    ],
)
def test_each_level_is_written_to_its_stream(
    level: int, stream: str, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    console().emit(record(level))
    out, err = capsys.readouterr()
    assert (out, err) == ((line, "") if stream == "stdout" else ("", line))


def test_a_terminal_gets_noetics_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    out, err = Terminal(), Terminal()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    for level in (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR):
        console("${severity}").emit(record(level))
    assert out.getvalue() == "\033[32mDEBUG\n\033[0mINFO\n"
    assert err.getvalue() == "\033[33mWARN\n\033[0m\033[31mERROR\n\033[0m"


def test_every_placeholder_is_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    line_format = "${severity}|${message}|${logger}|${file}|${line}|${function}|${node}|${walltime:%Y}|${odd}"
    console(line_format).emit(record(logging.INFO))
    expected = "INFO|hello|rosout|/code/talker.py|7|talk|/talker_node|2026|${odd}\n"
    assert capsys.readouterr().out == expected


def test_simulated_time_is_logged_beside_wall_time(capsys: pytest.CaptureFixture[str]) -> None:
    clock = SimulatedClock()
    clock.set_ns(2_500_000_000)
    console(clock=clock).emit(record(logging.INFO))
    assert capsys.readouterr().out == "[INFO] [1795144503.366333, 2.500000]: hello\n"


def test_a_closed_console_does_not_stop_a_node(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    closed = io.StringIO()
    closed.close()
    for stdout in (closed, None):
        monkeypatch.setattr(sys, "stdout", stdout)
        console().emit(record(logging.INFO))
    assert capsys.readouterr().err == ""


def test_wrong_arguments_of_a_log_call_raise_in_the_caller() -> None:
    wrong = record(logging.INFO, "%d")
    wrong.args = ("x",)
    with pytest.raises(TypeError):
        console().emit(wrong)


def test_ros_has_five_levels() -> None:
    assert [Severity.of(level).number for level in (5, 10, 20, 25, 30, 40, 50)] == [1, 1, 2, 2, 4, 8, 16]


def test_levels_are_set_by_ros_names_and_an_unknown_one_changes_nothing() -> None:
    set_logger_level("pipros.test.levels", "WaRn")
    assert ("pipros.test.levels", "WARN") in logger_levels()
    set_logger_level("pipros.test.levels", "loud")
    assert logging.getLogger("pipros.test.levels").level == logging.WARNING


def test_a_log_file_is_named_after_the_node() -> None:
    assert log_file(Path("/log"), "/ns/talker", None) == Path("/log/ns_talker.log")
    assert log_file(Path("/log"), "/ns/talker", "/elsewhere/t.log") == Path("/elsewhere/t.log")


def test_a_log_file_is_not_a_device_of_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.node.log.ON_WINDOWS", True)
    assert log_file(Path("/log"), "/aux", None) == Path("/log/aux_.log")
    assert log_file(Path("/log"), "/ns/aux", None) == Path("/log/ns_aux.log")
