from __future__ import annotations

import pytest

from pipros.basics.printable import printable


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("/talker", "/talker"),
        ("Überraschung 漢字", "Überraschung 漢字"),
        ("\x1b]0;OWNED\x07", r"\x1b]0;OWNED\x07"),
        ("a\nb\r\tc", r"a\nb\r\tc"),
        ("\x9b31m", r"\x9b31m"),  # the one-byte form of an escape sequence
        ("\u202egnp.exe", r"\u202egnp.exe"),  # right-to-left text
        ("\u2028", r"\u2028"),
        ("\udc80", r"\udc80"),
        (["a\n"], r"['a\n']"),
    ],
)
def test_no_control_character_is_left(value: object, shown: str) -> None:
    assert printable(value) == shown


def test_a_long_text_is_cut() -> None:
    assert printable("x" * 1000) == "x" * 197 + "..."
    assert printable("x" * 200) == "x" * 200
