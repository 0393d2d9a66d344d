"""Untrusted regular expressions: their matches, and their time limit."""

import io
import json
import signal
from collections.abc import Iterator

import pytest

from pipros_libraries.diagnostics import match_names
from pipros_libraries.diagnostics.name_patterns import NAME_CHARACTERS, NamePatterns


def test_whole_names_are_matched_by_any_pattern() -> None:
    patterns = NamePatterns(["motor [0-9]+", "(left|right)*", r"(.)\1"])
    assert [
        name
        for name in ("motor 12", "motor 12 ", "a motor 1", "leftright", "aa", "ab")
        if patterns.match(name)
    ] == ["motor 12", "leftright", "aa"]
    assert not NamePatterns([])
    assert patterns.slow == []


def test_names_that_are_too_long_match_nothing() -> None:
    patterns = NamePatterns([".*"])
    assert patterns.match("x" * NAME_CHARACTERS)
    assert not patterns.match("x" * (NAME_CHARACTERS + 1))


@pytest.mark.parametrize(("pattern", "name"), [
    ("(a+)+$", "a" * 40 + "!"), ("(a|a)*b", "a" * 40), ("a?" * 40 + "a" * 40 + "b", "a" * 60),
    ("(.*)" * 12 + "=", "x" * 300),
])  # fmt: skip
def test_a_pattern_that_takes_too_long_is_aborted(pattern: str, name: str) -> None:
    patterns = NamePatterns(["fine", pattern])
    assert not patterns.match(name)
    assert patterns.slow == [pattern]
    assert patterns.match("fine")


@pytest.mark.parametrize(("pattern", "reason"), [
    ("(", "missing \\)"), ("*", "nothing to repeat"), ("a{4294967296}", "the repetition number is too large"),
    (r"\q", "bad escape"), ("[z-a]", "bad character range"),
])  # fmt: skip
def test_invalid_patterns_raise(pattern: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        NamePatterns([pattern])


# The child process that matches names: one answer for each line.


QUESTIONS = {
    ("motor [0-9]+", "motor 12"): True, ("motor", "motor 12"): False, ("(a+)+$", "a" * 40 + "!"): None,
    ("(", "anything"): "missing ), unterminated subpattern at position 0", (".*", "after a slow one"): True,
}  # fmt: skip


@pytest.fixture
def handlers() -> Iterator[None]:
    """Restore the signal handlers, which the program replaces for its process."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGPROF)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.needs("timer signals")
@pytest.mark.usefixtures("handlers")
def test_each_line_is_answered_in_order(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    lines = "".join(json.dumps(question) + "\n" for question in QUESTIONS)
    monkeypatch.setattr("sys.stdin", io.StringIO(lines))

    match_names.main()

    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == list(QUESTIONS.values())
