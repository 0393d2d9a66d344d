"""The child process that matches names: one answer for each line."""

from __future__ import annotations

import io
import json
import signal
from collections.abc import Iterator

import pytest

from pipros_libraries.diagnostics import match_names

QUESTIONS = {
    ("motor [0-9]+", "motor 12"): True,
    ("motor", "motor 12"): False,
    ("(a+)+$", "a" * 40 + "!"): None,
    ("(", "anything"): "missing ), unterminated subpattern at position 0",
    (".*", "after a slow one"): True,
}


@pytest.fixture
def handlers() -> Iterator[None]:
    """Restore the signal handlers, which the program replaces for its process."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGPROF)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.needs("timer signals")
@pytest.mark.usefixtures("handlers")
def test_each_line_is_answered_in_order(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = "".join(json.dumps(question) + "\n" for question in QUESTIONS)
    monkeypatch.setattr("sys.stdin", io.StringIO(lines))

    match_names.main()

    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == list(QUESTIONS.values())
