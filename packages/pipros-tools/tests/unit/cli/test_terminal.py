"""Output on a terminal, none of which is written to a pipe."""

import pytest

from pipros_tools.cli.terminal import (
    CYAN,
    LiveBlock,
    aligned,
    has_colours,
    is_terminal,
    paragraph,
    passing_note,
    table,
)
from pipros_tools.graph.measurements import bandwidth_table
from pipros_tools.graph.samples import SampleFigures

ROWS = [["/scan", "[a/Scan]", "1"], ["/battery", "[b/B]", "12"]]


def pretend_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setenv("LINES", "10")
    monkeypatch.delenv("NO_COLOR", raising=False)


def test_a_pipe_gets_the_cells_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: False)

    assert table(ROWS, ("", CYAN, "")) == ["/scan [a/Scan] 1", "/battery [b/B] 12"]


def test_a_terminal_gets_columns_and_colours(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend_terminal(monkeypatch)
    assert table(ROWS, ("", CYAN, "")) == [
        "/scan    \x1b[36m[a/Scan]\x1b[0m 1",
        "/battery \x1b[36m[b/B]   \x1b[0m 12",
    ]


def test_no_color_keeps_the_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend_terminal(monkeypatch)
    monkeypatch.setenv("NO_COLOR", "1")

    assert is_terminal()
    assert not has_colours()
    assert table(ROWS, ("", CYAN, "")) == ["/scan    [a/Scan] 1", "/battery [b/B]    12"]


def test_a_dumb_terminal_is_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend_terminal(monkeypatch)
    monkeypatch.setenv("TERM", "dumb")

    assert not is_terminal()


def test_no_rows_give_no_lines() -> None:
    assert aligned([]) == []


def test_a_paragraph_is_broken_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "rosnode cleanup, then start /a_node_with_a_long_name_that_no_line_holds again"
    assert paragraph(text, indent=2) == text
    pretend_terminal(monkeypatch)
    assert paragraph(text, indent=2, taken=10).split("\n") == [
        "rosnode cleanup, then start", "  /a_node_with_a_long_name_that_no_line_holds", "  again"
    ]  # fmt: skip


def test_a_progress_note_is_erased(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    with passing_note("asking"):
        pass
    assert capsys.readouterr() == ("", "")
    pretend_terminal(monkeypatch)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with passing_note("asking"):
        assert capsys.readouterr() == ("", "asking")
    assert capsys.readouterr() == ("", "\r\x1b[K")


@pytest.mark.parametrize(("first", "then"), [
    ("a\nb", "\x1b[2A\x1b[Jc\n"),
    ("x" * 81, "\x1b[3A\x1b[Jc\n"),  # a line counts as often as it wraps
    ("\n" * 20, "c\n"),  # higher than the screen
])  # fmt: skip
def test_a_block_replaces_the_one_before_unless_it_is_higher_than_the_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], first: str, then: str
) -> None:
    pretend_terminal(monkeypatch)
    block = LiveBlock()
    block.show(first)
    block.show("c")

    assert capsys.readouterr().out == f"{first}\n{then}"


def test_a_line_in_between_stays(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    pretend_terminal(monkeypatch)
    block = LiveBlock()
    block.show("a")
    block.say("time has reset")
    block.show("b")

    assert capsys.readouterr().out == "a\ntime has reset\nb\n"


def test_blocks_follow_each_other_in_a_pipe(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: False)
    block = LiveBlock()
    block.show("a")
    block.show("b")

    assert capsys.readouterr().out == "a\nb\n"


def test_bandwidths_of_several_topics_are_a_table() -> None:
    sizes = SampleFigures(100.0, 50.0, 3000.0, 1.0, 7)

    assert bandwidth_table({"/a": (2000.0, sizes), "/bb": (1.0, sizes)}).split("\n") == [
        "topic   average      mean     min      max     window",
        "=====================================================",
        "/a      2.00KB/s   100.00B   50.00B   3.00KB   7     ",
        "/bb     1.00B/s    100.00B   50.00B   3.00KB   7     ",
        "",
    ]
