"""The prefix before each line of a node's output, without a terminal."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.launch.output_prefix import LinePrefix, is_available


@pytest.mark.parametrize(
    ("pieces", "shown"),
    [
        ([b"one\ntwo\n"], b"[n] one\n[n] two\n"),
        ([b"on", b"e\nt", b"wo\n"], b"[n] one\n[n] two\n"),
        ([b"\n\n"], b"[n] \n[n] \n"),
        ([b"prompt> ", b"answer\n", b"next\n"], b"[n] prompt> answer\n[n] next\n"),
        ([b"10 %\r20 %\r", b"done\n"], b"[n] 10 %\r20 %\rdone\n"),
        ([b"one\ntwo", b" more\nthree\n"], b"[n] one\n[n] two more\n[n] three\n"),
        ([b"\033[33mwarned\n", b"\033[0m", b"next\n"], b"[n] \033[33mwarned\n\033[0m[n] next\n"),
        ([b""], b""),
    ],
)
def test_each_line_has_one_prefix_however_it_comes_in_pieces(pieces: list[bytes], shown: bytes) -> None:
    prefix = LinePrefix(b"[n] ")
    assert b"".join(map(prefix.format, pieces)) == shown


@given(st.lists(st.binary(max_size=8)))
def test_nothing_of_the_output_is_lost(pieces: list[bytes]) -> None:
    prefix = LinePrefix(b"<PREFIX>")
    shown = b"".join(map(prefix.format, pieces))
    assert shown.replace(b"<PREFIX>", b"") == b"".join(pieces)


def test_there_is_no_prefix_where_the_output_is_not_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    assert not is_available()
