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
    r"(?<![/\"'])\b[Ss]omebody\b": "a user, a process, a node",
    r"\b[Hh]armless when repeated\b": "May be repeated",
    r"\b[Hh]elps? nobody\b": "does not help",
    r"\bbefore all else\b": "first",
    r"\bwhatever became\b": "whatever the outcome",
    r"\bg(?:ive|ives|iving|ave) way\b": "is closed for, is replaced by",
    r"\b[Ww]hat (?:comes|came|stands|stood|waits|waited)\b": "the message, the input, the entry, the queue",
    r"(?:^|[.:;(#\"])\s*Has (?:[\w.`'/-]+ ){1,8}?(?:be|do|go|have)\b": "the verb: Resolve …, Send …, Run …",
    r"(?<![/\"'])\b[Nn]obody\b": "no node, no subscriber, no user, not … anywhere",
    r"\b[Tt]hat which\b": "the message, the value, whatever it is",
    r"\bhears? of\b": "is notified of, receives",
    r", which it must\b": "missing required …, must …",
    r"\b[Oo]nly when asked\b": "on request, only with --option",
    r"\b[Tt]ells? (?:it|them|him)\b": "notify, send, inform",
    r"(?<!with )\b[Tt]he most (?:[a-z]+[^us]s|bytes|looks)\b": "maximum number of …",
    r"\bin the words of\b": "with the text of",
    r"\bdoes his worst\b": "during an attack",
    r"\bpicture = SystemState\b": "state = SystemState",
    r"\b(?:is|are|was|were) away\b": "is not available",
    r"\btakers?\b": "client, subscriber, user",
    r"\b(?:form|make)(?:s|ing)? a circle\b": "a cycle",
    r"\b(?:[Ss]end|[Pp]ublish|[Ll]isten|[Oo]ffer)\w{0,2} (?:[\w ]+ )?(?:nothing|no) more\b(?! than)": "stop",
    r"\b(?:has|have) come or gone\b": "has connected or disconnected",
    r"\b[Hh]ow soon\b": "interval, delay, timeout",
    r"\bin (?:its|their|\w+'s) words\b": "as worded by …, with the texts of …",
    r"\b[Kk]eep the arguments\b": "Store the settings.",
}

# Texts that must equal Noetic's: (file below the repository, text).
ALLOWED: set[tuple[str, str]] = set()

PLACES = (
    "packages",
    "docs",
    "script",
    ".ci",
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
)
# Recordings of genuine programs, and this file, which names the phrases.
LEFT_OUT = (
    "packages/pipros/tests/golden/",
    "packages/pipros-page/tests/golden/",
    "packages/pipros-robot/tests/golden/",
    "packages/pipros/tests/fuzz/corpus/",
    "packages/pipros/tests/interop/programs/",
    "packages/pipros/tests/tree/test_prose.py",
)
_SUFFIXES = {".py", ".md", ".sh", ".bash", ".zsh", ".fish", ""}
_PATTERN = re.compile("|".join(f"(?:{phrase})" for phrase in AVOIDED))
_TEST_NAME = re.compile(r"\btest_\w+")


def avoided_in(text: str) -> list[tuple[int, str]]:
    """Return the number and the text of each line with a phrase to avoid.

    The underscores in the names of tests count as blanks.
    """
    return [
        (number, line.strip())
        for number, line in enumerate(text.split("\n"), 1)
        if _PATTERN.search(_TEST_NAME.sub(lambda name: name[0].replace("_", " "), line))
    ]


def files() -> list[Path]:
    found = []
    for place in (REPOSITORY / name for name in PLACES):
        found += [place] if place.is_file() else sorted(place.rglob("*"))
    share = {"share"}
    return [
        file
        for file in found
        if file.is_file()
        and file.suffix in _SUFFIXES
        and "__pycache__" not in file.parts
        and not share & {each.name for each in file.parents}
        and not file.relative_to(REPOSITORY).as_posix().startswith(LEFT_OUT)
    ]


def test_code_docs_and_scripts_avoid_translated_phrases() -> None:
    wrong = []
    for file in files():
        name = file.relative_to(REPOSITORY).as_posix()
        for number, line in avoided_in(file.read_text(encoding="utf-8", errors="replace")):
            if not any(name == where and text in line for where, text in ALLOWED):
                wrong.append(f"{name}:{number}: {line}")
    assert not wrong, "rewrite these; tests.tree.test_prose says what to write instead:\n" + "\n".join(wrong)


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
        "the link gave way to a newer one",
        "def test_what_makes_no_sense_is_refused() -> None:",
        "def test_nobody_else_writes_to_it() -> None:",
        '"""Has names be remapped as those of a node of that full name."""',
        "# Has the node go on.",
        "Sent to nobody.",
        "returns that which was asked for",
        "the node hears of its publishers",
        "the file does not contain the key X, which it must",
        "compresses only when asked",
        "passes on what came",
        "drops what waits in the queue",
        "the master tells them about it",
        "The most looks at the socket before it sleeps.",
        "the most connections of one host",
        "None while the master is away",
        "latched messages come first for each taker",
        "the links form a circle",
        "Send nothing more.",
        "Offer a service no more.",
        "called when a client has come or gone",
        "How soon a page shows new values.",
        "the checks of Noetic, in its words",
        '"""Keep the arguments. `limit` is the maximum."""',
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
        "Has a publisher been seen?",
        "the most recent message",
        "the peer with the most links",
        "rosnode ping /nobody",
        "Returns the newest, or what the caller gave.",
        "Both turtles drive in a circle.",
        "Send no more than ten messages.",
    ],
)
def test_plain_english_is_accepted(line: str) -> None:
    assert avoided_in(line) == []


def test_every_allowed_text_still_exists() -> None:
    for name, text in ALLOWED:
        assert text in (REPOSITORY / name).read_text(encoding="utf-8")
