"""Texts of peers, without anything that hides or controls."""

import json
import pickle
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

import pipros.node  # noqa: F401 # it imports most errors
from pipros.basics.errors import PiprosError
from pipros.basics.hidden_text import LONGEST_TEXT, safe, safe_text
from pipros.basics.printable import printable
from pipros.msg import load_message_class


@pytest.mark.parametrize(("value", "shown"), [
    ("/talker", "/talker"), ("Überraschung 漢字", "Überraschung 漢字"),
    ("\x1b]0;OWNED\x07", r"\x1b]0;OWNED\x07"), ("a\nb\r\tc", r"a\nb\r\tc"), ("\x9b31m", r"\x9b31m"),
    ("\N{RIGHT-TO-LEFT OVERRIDE}gnp.exe", r"\u202egnp.exe"), ("\u2028", r"\u2028"), ("\udc80", r"\udc80"),
    (["a\n"], r"['a\n']"),
])  # fmt: skip
def test_no_control_character_is_left(value: object, shown: str) -> None:
    assert printable(value) == shown


def test_a_long_text_is_cut() -> None:
    assert (printable("x" * 1000), printable("x" * 200)) == ("x" * 197 + "...", "x" * 200)


def errors_of_all_kinds() -> list[BaseException]:
    kinds: list[type[BaseException]] = [PiprosError]
    for kind in kinds:
        kinds += kind.__subclasses__()
    assert len(kinds) > 20
    return [kind.__new__(kind) for kind in kinds if kind.__str__ is PiprosError.__str__]


def test_errors_of_all_kinds_reach_other_processes() -> None:
    for error in errors_of_all_kinds():
        error.args = ("text", 3)
        vars(error)["peer"] = "/talker"
        for protocol in (0, pickle.HIGHEST_PROTOCOL):
            copy = pickle.loads(pickle.dumps(error, protocol))  # noqa: S301  # its own
            assert (type(copy), copy.args, vars(copy)) == (type(error), error.args, {"peer": "/talker"})


def test_errors_of_all_kinds_quote_long_values_in_part() -> None:
    for error in errors_of_all_kinds():
        error.args = (f"no {'x' * 9_000} in {'/y' * 3_000} of line 3",)
        assert "(of 6000 characters) of line 3" in str(error)
        assert len(str(error)) < 5_200
        error.args = ("word " * 10_000,)
        assert len(str(error)) < 20_100
    with pytest.raises(PiprosError, match=r"\(of 3\d{6} characters\)"):
        load_message_class(f"std_msgs/{'x' * 3_000_000}")


# Text without anything hidden: controls, reordering, tags, blank letters.


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
    lambda parts: st.lists(parts, max_size=4) | st.dictionaries(st.text(), parts, max_size=4),
    max_leaves=20,
)


@pytest.mark.parametrize("hidden", [
    "\x1b[2J", "\x00", "\r\n", "\x9b31m", "\ud800", "\ufe0f", "\U000e0100",
    "\N{RIGHT-TO-LEFT OVERRIDE}", "\N{LEFT-TO-RIGHT ISOLATE}", "\N{ZERO WIDTH SPACE}",
    "\N{ZERO WIDTH NO-BREAK SPACE}", "\N{TAG LATIN CAPITAL LETTER A}", "\N{HANGUL FILLER}",
    "\N{BRAILLE PATTERN BLANK}",
])  # fmt: skip
def test_hidden_characters_become_escapes(hidden: str) -> None:
    assert safe_text(f"a{hidden}b").isascii()
    assert "\\" in safe_text(hidden)


def test_visible_text_of_all_languages_stays() -> None:
    assert safe_text("Tür, дверь, 门, דלת") == "Tür, дверь, 门, דלת"


def test_long_text_is_cut() -> None:
    assert safe_text("x" * (LONGEST_TEXT + 5)).endswith("x... (5 more characters)")


@given(st.text(st.characters()))
def test_no_character_hides_or_reorders(text: str) -> None:
    shown = safe_text(text)
    assert shown.isprintable()
    for character in shown:
        assert unicodedata.category(character) not in ("Cc", "Cf", "Co", "Cs")
        assert unicodedata.bidirectional(character) not in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI")


@given(VALUES)
def test_every_value_becomes_json_of_harmless_text(value: object) -> None:
    assert json.dumps(safe(value), ensure_ascii=False, allow_nan=False).isprintable()


def test_values_of_json_stay_what_they_are() -> None:
    assert str(safe([None, True, 5, "a"])) == "[None, True, 5, 'a']"
