"""Words that code, docs and scripts avoid: they read as translated, or are metaphors (docs/glossary.md)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY

# Each phrase with what to write instead.
AVOIDED: dict[str, str] = {
    r"(?<![Tt]here )\b(?:is|are|was|were) no (?!longer\b|more\b|less\b)": "is not a …, are not …",
    r"(?<![Tt]here )\b(?:is|are|was|were) none\b": "is not one, does not exist",
    r"[Tt]here (?:is|are) no such\b": "the … does not exist",
    r"\bmakes? no sense\b": "is not valid, cannot be used",
    r"\bof the moment\b": "current",
    r"\bin the moment\b": "when",
    r"\bfor one in\b": "a loop variable that says what it is",
    r"\bby heart\b": "in advance",
    r"\bt(?:ake|akes|aken|aking)(?: \w+)? apart\b": "split, decomposed",
    r"\b[Ss]omebody\b": "a user, a process, a node",
    r"\b[Hh]armless when repeated\b": "May be repeated",
    r"\b[Hh]elps? nobody\b": "does not help",
    r"\bbefore all else\b": "first",
    r"\bwhatever became\b": "whatever the outcome",
    r"\bgives? way\b": "is closed for, is replaced by",
    r"\bwhat stands\b": "the text, the comment, the entry",
    r"\bin the words of\b": "with the text of",
    r"\bdoes his worst\b": "during an attack",
    r"\bpicture = SystemState\b": "state = SystemState",
}

# Texts that equal Noetic's, where it says so itself: (file below the repository, text).
ALLOWED: set[tuple[str, str]] = set()

PLACES = ("src", "facades", "docs", "script", ".ci", "benchmarks", "README.md", "CONTRIBUTING.md")
_SUFFIXES = {".py", ".md", ".sh", ".bash", ".zsh", ".fish", ""}
_PATTERN = re.compile("|".join(f"(?:{phrase})" for phrase in AVOIDED))


def avoided_in(text: str) -> list[tuple[int, str]]:
    """The numbers and the texts of the lines with a phrase to avoid."""
    return [
        (number, line.strip()) for number, line in enumerate(text.split("\n"), 1) if _PATTERN.search(line)
    ]


def files() -> list[Path]:
    found = []
    for place in (REPOSITORY / name for name in PLACES):
        found += [place] if place.is_file() else sorted(place.rglob("*"))
    share = REPOSITORY / "src" / "pipros" / "share"
    return [
        file
        for file in found
        if file.is_file()
        and file.suffix in _SUFFIXES
        and "__pycache__" not in file.parts
        and share not in file.parents
    ]


def test_code_docs_and_scripts_avoid_translated_phrases() -> None:
    wrong = []
    for file in files():
        name = file.relative_to(REPOSITORY).as_posix()
        for number, line in avoided_in(file.read_text(encoding="utf-8", errors="replace")):
            if not any(name == where and text in line for where, text in ALLOWED):
                wrong.append(f"{name}:{number}: {line}")
    assert wrong == [], "rewrite these; tests/unit/test_prose.py says what to write instead"


@pytest.mark.parametrize(
    "line",
    [
        "[x] is no node name: it must be a name without a namespace",
        "what ends with a slash are no files",
        "the first line, where it is none",
        "NotFound: there is no such package.",
        "a port that makes no sense",
        "the input of the moment",
        "sum(one.size for one in members)",
        "the type is taken apart",
        "takes URIs apart",
        "Somebody listens.",
        "Closes it. Harmless when repeated.",
        "the oldest gives way to the newest",
        "the words, as what stands in brackets",
    ],
)
def test_each_phrase_is_found(line: str) -> None:
    assert avoided_in(f"above\n{line}\nbelow") == [(2, line)]


@pytest.mark.parametrize(
    "line",
    [
        "There is no master at this address.",
        "there are none left",
        "the service is no longer offered",
        "it is None when nothing came",
        "the answer is not one",
    ],
)
def test_plain_english_is_not_found(line: str) -> None:
    assert avoided_in(line) == []


def test_every_allowed_text_is_still_there() -> None:
    for name, text in ALLOWED:
        assert text in (REPOSITORY / name).read_text(encoding="utf-8")
