"""Log lines: Noetic's format, streams and colours, and the location of the caller."""

import io
import logging
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.node.clock import SimulatedClock, WallClock
from pipros.node.identity import Identity
from pipros.node.log import (
    ConsoleHandler,
    FileHandler,
    RosoutHandler,
    Severity,
    log_file,
    logger_levels,
    set_logger_level,
)
from pipros.node.log_outputs import open_console_and_file, open_rosout
from pipros.node.throttled_warnings import FULL, ThrottledWarnings
from tests.support.nodes import listening_log


def record(level: int, text: str = "hello") -> logging.LogRecord:
    made = logging.LogRecord("rosout", level, "/code/talker.py", 7, text, (), None, "talk")
    made.created = 1795144503.366333
    return made


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def console(line_format: str | None = None, clock: SimulatedClock | None = None) -> ConsoleHandler:
    return ConsoleHandler("/talker_node", lambda: clock or WallClock(), line_format)


@pytest.mark.parametrize(("level", "stream", "line"), [
    (logging.DEBUG, "stdout", "[DEBUG] [1795144503.366333]: hello\n"),
    (logging.INFO, "stdout", "[INFO] [1795144503.366333]: hello\n"),
    (logging.WARNING, "stderr", "[WARN] [1795144503.366333]: hello\n"),
    (logging.ERROR, "stderr", "[ERROR] [1795144503.366333]: hello\n"),
    (logging.CRITICAL, "stderr", "[FATAL] [1795144503.366333]: hello\n"),
])  # fmt: skip
def test_each_level_is_written_to_its_stream(level: int, stream: str, line: str, capsys) -> None:
    console().emit(record(level))
    out, err = capsys.readouterr()
    assert (out, err) == ((line, "") if stream == "stdout" else ("", line))


def test_a_program_may_log_what_is_printed(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    handler = console()
    logging_stream = SimpleNamespace(write=lambda _: handler.emit(record(logging.INFO)))
    monkeypatch.setattr(sys, "stdout", logging_stream)
    print("hello")
    assert capsys.readouterr().out.startswith("[INFO] [1795144503.366333]: hello\n")


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


def test_a_closed_console_does_not_stop_a_node(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
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
    monkeypatch.setattr("pipros.basics.file_names.ON_WINDOWS", True)
    assert log_file(Path("/log"), "/aux", None) == Path("/log/aux_.log")
    assert log_file(Path("/log"), "/ns/aux", None) == Path("/log/ns_aux.log")


# Log outputs


@pytest.fixture
def root() -> Iterator[logging.Logger]:
    """The root logger, whose handlers and level are restored."""
    logger = logging.getLogger()
    handlers, level = list(logger.handlers), logger.level
    yield logger
    for handler in set(logger.handlers) - set(handlers):
        logger.removeHandler(handler)
        handler.close()
    logger.setLevel(level)


def node(folder: Path, *argv: str, **variables: str) -> Any:
    """Return the parts of a node that its log needs."""
    environment = Environment.from_os({"ROS_LOG_DIR": str(folder), **variables})
    identity = Identity.from_arguments("talker", anonymous=False, argv=argv, environment=environment)
    params = SimpleNamespace(get_cached=lambda _: False)
    return SimpleNamespace(
        name=identity.name, identity=identity, environment=identity.environment, params=params,
        clock=SimpleNamespace(is_simulated=False, now_ns=lambda: 5_000_000_007),
        endpoints=SimpleNamespace(publications=[SimpleNamespace(topic="/chatter")]),
    )  # fmt: skip


def opened_file(root: logging.Logger) -> FileHandler:
    (handler,) = (handler for handler in root.handlers if isinstance(handler, FileHandler))
    return handler


def test_the_file_is_named_after_the_node_and_receives_the_lines_of_all_loggers(tmp_path, root) -> None:
    logger = logging.Logger("rosout")
    open_console_and_file(node(tmp_path / "log"), logger, None)
    logging.getLogger("mine").warning("low battery")
    opened_file(root).close()

    (line,) = (tmp_path / "log" / "talker.log").read_text().splitlines()
    assert line.startswith("[mine][WARNING]")
    assert line.endswith("low battery")
    assert [type(handler) for handler in logger.handlers] == [ConsoleHandler]


def test_a_file_on_the_command_line_takes_precedence(tmp_path: Path, root: logging.Logger) -> None:
    open_console_and_file(node(tmp_path, f"__log:={tmp_path / 'my.log'}"), logging.Logger("rosout"), None)
    logging.getLogger("mine").warning("low battery")
    assert "low battery" in (tmp_path / "my.log").read_text()


def test_an_unwritable_folder_disables_only_the_log_file(tmp_path, root: logging.Logger, capsys) -> None:
    (tmp_path / "log").write_text("a file")
    logger = logging.Logger("rosout")
    open_console_and_file(node(tmp_path / "log"), logger, None)
    logger.warning("low battery")
    written = capsys.readouterr().err
    assert f"WARNING: cannot write to log file [{tmp_path / 'log' / 'talker.log'}]" in written
    assert "set ROS_LOG_DIR to a writable location" in written
    assert "low battery" in written


@pytest.mark.parametrize("suffix", ["yaml", "conf"])
def test_a_configuration_that_names_an_unwritable_file_is_replaced(
    tmp_path: Path, root: logging.Logger, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    config, blocked = tmp_path / f"logging.{suffix}", tmp_path / f"a file of {suffix}"
    blocked.touch()
    file = f"{blocked.as_posix()}/x.log"
    config.write_text(
        f"version: 1\nhandlers: {{all: {{class: logging.FileHandler, filename: '{file}'}}}}\n"
        if suffix == "yaml"
        else "[loggers]\nkeys=root\n[handlers]\nkeys=all\n[formatters]\nkeys=\n[logger_root]\nhandlers=all\n"
        f"[handler_all]\nclass=FileHandler\nargs=('{file}',)\n"
    )
    logger = logging.Logger("rosout")
    open_console_and_file(node(tmp_path, ROS_PYTHON_LOG_CONFIG_FILE=str(config)), logger, None)
    logger.warning("low battery")
    written = capsys.readouterr().err
    assert f"WARNING: cannot write to log file [{blocked / 'x.log'}]" in written
    assert "low battery" in written


def test_a_missing_configuration_is_reported_and_ignored(tmp_path, root: logging.Logger, capsys) -> None:
    logger = logging.Logger("rosout")
    open_console_and_file(node(tmp_path, ROS_PYTHON_LOG_CONFIG_FILE=f"{tmp_path}/none.conf"), logger, None)
    logger.warning("low battery")
    written = capsys.readouterr().err
    assert "none.conf] does not exist" in written
    assert "low battery" in written


@pytest.mark.parametrize(("ros_level", "level"), [(1, 10), (2, 20), (4, 30), (8, 40), (16, 50), (None, 20)])
def test_levels_are_given_by_ros_numbers(tmp_path, root, ros_level: int | None, level: int) -> None:
    logger = logging.Logger("rosout")
    open_console_and_file(node(tmp_path), logger, ros_level)
    assert logger.level == level


def test_a_configuration_of_pythons_logging_replaces_both(tmp_path: Path, root: logging.Logger) -> None:
    config = tmp_path / "logging.yaml"
    config.write_text("version: 1\nincremental: true\nloggers: {mine: {level: ERROR}}\n")
    logger = logging.Logger("rosout")
    before = list(root.handlers)
    open_console_and_file(node(tmp_path, ROS_PYTHON_LOG_CONFIG_FILE=str(config)), logger, 1)
    assert (logger.handlers, logger.level, root.handlers) == ([], logging.DEBUG, before)
    assert logging.getLogger("mine").level == logging.ERROR
    logging.getLogger("mine").setLevel(logging.NOTSET)


CONFIGURATIONS = {
    "python_logging.yaml": "incremental: true\nloggers: {mine: {level: ERROR}}\n",
    "python_logging.conf": "[loggers]\nkeys=root,mine\n[handlers]\nkeys=ros\n[formatters]\nkeys=\n"
    "[logger_root]\nlevel=INFO\nhandlers=ros\n[logger_mine]\nlevel=ERROR\nhandlers=\nqualname=mine\n"
    "[handler_ros]\nclass=rosgraph.roslogging.RosStreamHandler\nargs=()\n",
}


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_configuration_in_the_folder_of_ros_is_found(tmp_path, root: logging.Logger, name: str) -> None:
    config = tmp_path / "home" / "config" / name
    config.parent.mkdir(parents=True)
    config.write_text(CONFIGURATIONS[name])
    open_console_and_file(node(tmp_path, ROS_HOME=str(tmp_path / "home")), logging.Logger("rosout"), 1)
    try:
        assert logging.getLogger("mine").level == logging.ERROR
    finally:
        logging.getLogger("mine").setLevel(logging.NOTSET)


@pytest.mark.needs("file owners")
def test_a_configuration_that_others_may_write_is_not_run(tmp_path, root: logging.Logger, capsys) -> None:
    config = tmp_path / "shared" / "config" / "python_logging.yaml"
    config.parent.mkdir(parents=True)
    config.write_text(CONFIGURATIONS[config.name])
    config.chmod(0o666)
    open_console_and_file(node(tmp_path, ROS_HOME=str(tmp_path / "shared")), logging.Logger("rosout"), 1)
    assert logging.getLogger("mine").level == logging.NOTSET
    assert "must not be writable by other users" in capsys.readouterr().err


@pytest.mark.parametrize(("is_off", "topics"), [(False, ["/chatter"]), (True, [])])
def test_lines_on_rosout_name_the_topics_unless_a_parameter_disables_it(
    tmp_path: Path, is_off: bool, topics: list[str]
) -> None:
    talker = node(tmp_path)
    published: list[Any] = []
    talker.params.get_cached = {"/rosout_disable_topics_generation": is_off}.__getitem__
    talker.advertise = lambda *_, **__: SimpleNamespace(publish=published.append)
    logger = logging.Logger("rosout")
    open_rosout(talker, logger)
    logger.error("low battery")
    assert [type(handler) for handler in logger.handlers] == [RosoutHandler]
    (line,) = published
    assert (line.name, line.msg, line.level, line.topics) == ("/talker", "low battery", 8, topics)
    assert (line.header.stamp.secs, line.header.stamp.nsecs) == (5, 7)


# Throttled warnings


def test_the_first_complaints_are_logged_and_the_others_counted() -> None:
    log, lines = listening_log()
    later: list[Callable[[], Any]] = []
    loop: Any = SimpleNamespace(asyncio=SimpleNamespace(call_later=lambda _, report: later.append(report)))
    warnings = ThrottledWarnings(log, loop, "%d more; the last is %s")

    allowed = [warnings.should_log(str(number)) for number in range(100)]

    assert allowed == [True] * FULL + [False] * (100 - FULL)
    assert (len(later), lines) == (1, [])
    later.pop()()
    assert lines == [f"{100 - FULL} more; the last is 99"]
    assert warnings.should_log("another")
    later.pop()()
    assert len(lines) == 1
