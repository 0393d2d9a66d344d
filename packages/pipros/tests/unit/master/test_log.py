"""`master.log`: registrations and parameter changes, with the node that made them."""

import logging
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.basics.limits import Limits
from pipros.master.api import MasterApi
from pipros.master.log import MasterLog
from pipros.master.params import ParamTree
from pipros.master.registry import Registry
from tests.support.waiting import wait_until

A, B = "http://a:1/", "http://b:2/"


@pytest.fixture
def api() -> MasterApi:
    return MasterApi(Registry(), ParamTree(), notify=lambda _: None, shutdown=lambda _: True)


class Opened:
    """A log of the calls between `open` and `lines`."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "log" / "master.log"

    def open(self, level: str | None = None, limits: Limits | None = None) -> None:
        self._log = MasterLog(self.file, level, limits=limits)

    def lines(self) -> list[str]:
        self._log.close()
        return self.file.read_text().splitlines()


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opened]:
    found = Opened(tmp_path)
    found.open()
    yield found
    found.lines()


def test_each_change_is_a_line_with_noetics_text(api: MasterApi, opened: Opened) -> None:
    call = api.methods
    call["registerSubscriber"]("/s", "t", "x/Y", A)
    call["registerPublisher"]("/p", "t", "x/Y", B)
    call["registerService"]("/p", "~srv", "rosrpc://b:3", B)
    call["subscribeParam"]("/s", A, "w")
    call["setParam"]("/p", "w", 1)
    call["deleteParam"]("/p", "w")
    call["unsubscribeParam"]("/s", A, "w")
    call["unregisterService"]("/p", "~srv", "rosrpc://b:3")
    call["unregisterPublisher"]("/p", "t", B)
    call["unregisterSubscriber"]("/s", "t", A)
    lines = opened.lines()
    assert [re.sub(r" \d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3}: ", " ", line) for line in lines] == [
        f"[rosmaster.master][INFO] {text}"
        for text in (
            f"+SUB [/t] /s {A}",
            f"+PUB [/t] /p {B}",
            f"+SERVICE [/p/srv] /p {B}",
            "+CACHEDPARAM [/w] by /s",
            "+PARAM [/w] by /p",
            "-PARAM [/w] by /p",
            "-CACHEDPARAM [/w] by /s",
            "-SERVICE [/p/srv] /p rosrpc://b:3",
            f"-PUB [/t] /p {B}",
            f"-SUB [/t] /s {A}",
        )
    ]


def test_calls_without_effect_are_not_logged_but_invalid_ones_are(api: MasterApi, opened: Opened) -> None:
    call = api.methods
    call["getParam"]("/p", "w")
    call["deleteParam"]("/p", "w")
    call["setParam"]("/p", "/", 1)
    call["unregisterPublisher"]("/p", "t", B)
    call["unsubscribeParam"]("/p", B, "w")
    call["registerPublisher"]("/p", "", "x/Y", B)
    [line] = opened.lines()
    assert line.endswith(
        "registerPublisher: invalid parameter: ERROR: parameter [topic] must be a non-empty string"
    )


def test_ignored_registrations_of_a_replaced_process_are_logged(api: MasterApi, opened: Opened) -> None:
    for uri in (A, B, A):
        api.methods["registerPublisher"]("/p", "t", "x/Y", uri)
    assert opened.lines()[-1].endswith(f"PUB [/t] of /p {A} ignored: that process was replaced")


def test_at_debug_level_calls_are_logged_however_large_their_values(api: MasterApi, opened: Opened) -> None:
    opened.lines()
    opened.open("debug")
    api.methods["setParam"]("/p", "w", "x" * 1_000_000)
    _, line = opened.lines()
    assert "[DEBUG]" in line
    assert "setParam('/p', 'w', 'xxx" in line
    assert "returns [1, 'parameter /w set', 0]" in line
    assert len(line) < 500


@pytest.mark.parametrize("level", ["nonsense", "warn"])
def test_levels_are_those_of_noetic(level: str, api: MasterApi, opened: Opened) -> None:
    opened.lines()
    opened.open(level)
    api.methods["setParam"]("/p", "w", 1)
    text = "\n".join(opened.lines())
    assert ("must be one of debug, info, warn, error, fatal, got [nonsense]" in text) == (level == "nonsense")
    assert ("+PARAM" in text) == (level == "nonsense")


def test_names_with_line_breaks_forge_no_lines(api: MasterApi, opened: Opened) -> None:
    api.methods["setParam"]("/p\n[rosmaster.master][INFO] +PARAM [/w] by /nobody", "w", 1)
    api.methods["setParam"]("/" + "p" * 10_000, "w", 1)
    first, second = opened.lines()
    assert "\\n[rosmaster.master]" in first
    assert len(second) < 3_000


def test_a_file_that_grows_too_large_is_put_aside(api: MasterApi, opened: Opened) -> None:
    opened.lines()
    for number in range(20):
        opened.open(limits=Limits(log_bytes=1_000))
        api.methods["setParam"]("/p", f"{number}/{'w' * 600}", 1)
        opened.lines()
    kept = sorted(opened.file.parent.iterdir())
    assert [found.name for found in kept] == [
        "master.log",
        *(f"master.log.{number}" for number in range(1, 5)),
    ]
    assert ["/19/" in kept[0].read_text(), "/18/" in kept[1].read_text()] == [True, True]


def test_a_file_that_cannot_be_reopened_loses_only_the_lines_of_that_time(
    api: MasterApi, opened: Opened, capsys: pytest.CaptureFixture[str]
) -> None:
    opened.lines()
    opened.file.unlink()
    opened.open(limits=Limits(log_bytes=1_000))
    folder, elsewhere = opened.file.parent, opened.file.parent.with_name("elsewhere")
    api.methods["setParam"]("/p", "first/" + "w" * 600, 1)
    wait_until(lambda: opened.file.exists() and opened.file.stat().st_size)
    folder.rename(elsewhere)
    folder.write_text("in the way")
    api.methods["setParam"]("/p", "lost/" + "w" * 600, 1)
    wait_until(lambda: "cannot write to log file" in capsys.readouterr().err)
    folder.unlink()
    elsewhere.rename(folder)
    wait_until(lambda: _logs_again(api, opened.file))
    assert "log entries before this line were lost" in opened.file.read_text()


def _logs_again(api: MasterApi, file: Path) -> bool:
    api.methods["setParam"]("/p", "again", time.monotonic())
    return file.exists() and "/again" in file.read_text()


def test_a_line_that_cannot_be_formatted_costs_no_other(api: MasterApi, opened: Opened) -> None:
    record = logging.LogRecord("other", logging.INFO, __file__, 1, "%d of them", ("no number",), None)
    opened._log.handle(record)
    api.methods["setParam"]("/p", "w", 1)
    first, second = opened.lines()
    assert "cannot be shown: '%d of them'" in first
    assert "+PARAM [/w]" in second


def test_a_closed_log_writes_nothing(api: MasterApi, tmp_path: Path) -> None:
    opened = MasterLog(tmp_path / "master.log")
    opened.close()
    api.methods["setParam"]("/p", "w", 1)
    opened.close()
    assert (tmp_path / "master.log").read_text() == ""
    assert logging.getLogger("rosmaster").level == logging.NOTSET
