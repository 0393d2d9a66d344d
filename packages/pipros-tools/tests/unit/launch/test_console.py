import io
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros_tools.launch.console import Console
from pipros_tools.launch.output_prefix import LinePrefix, PrefixedOutput, is_available


def test_the_console_prints_and_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    console = Console()
    console.open_log(tmp_path / "log")
    console.say("plain")
    console.bold("bold")
    console.title("title")
    console.detail("detail")
    console.error("wrong")
    console.close()
    captured = capsys.readouterr()
    assert captured.out == "plain\n\033[1mbold\033[0m\n\033]2;title\007\n"
    assert captured.err == "\033[31mwrong\033[0m\n"
    lines = (tmp_path / "log").read_text().splitlines()
    assert [line.rpartition(": ")[2] for line in lines] == ["plain", "bold", "detail", "wrong"]
    assert lines[0].startswith("[roslaunch][INFO] ")
    assert lines[3].startswith("[roslaunch][ERROR] ")


def test_a_title_is_optional_and_details_can_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(has_title=False, is_verbose=True)
    console.title("title")
    console.detail("detail")
    assert capsys.readouterr().out == "detail\n"


def test_a_closed_terminal_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    class Closed(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    monkeypatch.setattr("sys.stdout", Closed())
    Console().say("unheard")


# The prefix before each line of a node's output, without a terminal.


if sys.platform != "win32":
    import pty
    import tty


@pytest.mark.parametrize(("pieces", "shown"), [
    ([b"one\ntwo\n"], b"[n] one\n[n] two\n"), ([b"on", b"e\nt", b"wo\n"], b"[n] one\n[n] two\n"),
    ([b"\n\n"], b"[n] \n[n] \n"), ([b"prompt> ", b"answer\n", b"next\n"], b"[n] prompt> answer\n[n] next\n"),
    ([b"10 %\r20 %\r", b"done\n"], b"[n] 10 %\r20 %\rdone\n"),
    ([b"one\ntwo", b" more\nthree\n"], b"[n] one\n[n] two more\n[n] three\n"),
    ([b"\033[33mwarned\n", b"\033[0m", b"next\n"], b"[n] \033[33mwarned\n\033[0m[n] next\n"), ([b""], b""),
])  # fmt: skip
def test_each_line_has_one_prefix_even_if_it_arrives_in_pieces(pieces: list[bytes], shown: bytes) -> None:
    prefix = LinePrefix(b"[n] ")
    assert b"".join(map(prefix.format, pieces)) == shown


@given(st.lists(st.binary(max_size=8)))
def test_the_output_is_complete(pieces: list[bytes]) -> None:
    prefix = LinePrefix(b"<PREFIX>")
    shown = b"".join(map(prefix.format, pieces))
    assert shown.replace(b"<PREFIX>", b"") == b"".join(pieces)


def test_lines_have_no_prefix_unless_the_output_is_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    assert not is_available()


@pytest.mark.needs("pseudo-terminals")
@pytest.mark.parametrize("is_raw", [False, True])
def test_lines_start_in_the_first_column_while_a_node_reads_single_keys(monkeypatch, is_raw: bool) -> None:
    screen, terminal = pty.openpty()
    if is_raw:
        tty.setraw(terminal)
    with open(terminal, "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        output = PrefixedOutput("n", 0)
        os.write(output.write_end, b"one\ntwo\r\nthree\n")
        output.started()
        output.finish(30.0)
    assert (
        output.recent == b"one\ntwo\r\nthree\n"
        if is_raw
        else output.recent.splitlines() == [b"one", b"two", b"three"]
    )
    shown = b""
    while shown.count(b"\n") < 3:
        shown += os.read(screen, 1000)
    os.close(screen)
    assert shown.replace(b"\r\r\n", b"\r\n") == b"".join(
        b"\033[36m[n]\033[0m %s\r\n" % line for line in (b"one", b"two", b"three")
    )
