"""Patterns take time and memory proportional to the text, so that no file and no peer can use up either."""

from __future__ import annotations

import ast
import importlib
import re
import sys
import time
import tracemalloc
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from tests.support.environments import REPOSITORY, ROOTS, files_below

COUNTS = (12, 20, 28, 400, 4000)
"""Repetitions. An exponential pattern takes long for few already."""
MOST_CHARACTERS = 4000
LIMIT_S = 0.01
"""A linear pattern reads 4,000 characters in a tenth of a millisecond, a quadratic one in 50 ms, of processor
time. Python's patterns do not count their steps, and a slow one must be slow three times in a row."""
COSTLY_CHARACTERS = 200_000
COSTLY_BYTES = 40 * COSTLY_CHARACTERS
"""A group keeps some 200 bytes for each repetition: let it repeat longer pieces, or limit it: {0,999}."""

_SCRIPTS_PATTERN = re.compile(
    r"(?:[(=,:!?&|\[]|=>)\s*/((?![*/)])(?:\\.|\[(?:\\.|[^\]\\\n])*\]|[^/\\\n\[]){1,1000})/([dgimsuvy]*)"
)
METHODS = "match|fullmatch|search|finditer|findall|split|subn?"
READER: Any = importlib.import_module("re._parser" if sys.version_info >= (3, 11) else "sre_parse")
CLASSES = {"DIGIT": "1", "SPACE": " \n", "WORD": "a", "NOT_DIGIT": "a ", "NOT_SPACE": "a(", "NOT_WORD": "( "}


def text_of(node: ast.AST, names: dict[str, ast.expr]) -> Any:
    """Return a constant text, with `x/y` for parts that are known at run time only."""
    match node:
        case ast.Constant(value=value):
            return value
        case ast.JoinedStr(values=parts):
            return "".join(str(text_of(part, names)) for part in parts)
        case ast.BinOp(left=left, right=right):
            return text_of(left, names) + text_of(right, names)
        case ast.FormattedValue(value=value):
            return text_of(value, names)
        case ast.Name(id=name) if name in names:
            return text_of(names[name], {key: names[key] for key in names.keys() - {name}})
    return "x/y"


def patterns_in(text: str) -> Iterator[tuple[int, re.Pattern[Any], set[str]]]:
    """Yield the line of each pattern, the pattern, and the methods with which the file uses it."""
    nodes = [*ast.walk(ast.parse(text))]
    names = {
        target.id: node.value
        for node in nodes
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    }
    for node in nodes:
        function = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        if isinstance(node, ast.Call) and (called := re.fullmatch(rf"re\.({METHODS}|compile)", function)):
            name = next((name for name, value in names.items() if value is node), r"\w+")
            flags = re.findall(
                r"\bre\.([A-Z]+)\b", " ".join(map(ast.unparse, [*node.args[1:], *node.keywords]))
            )
            pattern = re.compile(text_of(node.args[0], names), sum({re.RegexFlag[flag] for flag in flags}))
            used = {called[1]} if called[1] != "compile" else {*re.findall(rf"\b{name}\.({METHODS})\b", text)}
            yield node.lineno, pattern, used


def scripts_patterns_in(text: str) -> Iterator[tuple[int, re.Pattern[Any], set[str]]]:
    """Yield the patterns of JavaScript, which backtracks like Python."""
    for found in _SCRIPTS_PATTERN.finditer(text):
        written = re.sub(r"\(\?<(?![=!])", "(?P<", found[1]).replace("(?<=", "(?:")  # JavaScript allows any
        flags = sum({re.RegexFlag[flag.upper()] for flag in found[2] if flag in "ims"})
        written = written.replace("[^]", r"[\s\S]").replace("[[", r"[\[")
        pattern = re.compile(written, flags | re.ASCII)
        yield text.count("\n", 0, found.start()) + 1, pattern, {"finditer" if "g" in found[2] else "search"}


def characters(items: Iterable[tuple[Any, Any]]) -> list[str]:
    """Return some characters of a class."""
    found, is_negated = "", False
    for operation, value in items:
        match str(operation):
            case "LITERAL":
                found += chr(value)
            case "RANGE":
                found += "".join(map(chr, range(value[0], min(value[1], 127) + 1)))
            case "CATEGORY":
                found += CLASSES[str(value).removeprefix("CATEGORY_")]
            case _:
                is_negated = True
    return [each for each in "a1 .(\"'<#\n" if each not in found] if is_negated else [*found]


def samples(items: Iterable[tuple[Any, Any]]) -> list[str]:
    """Return some texts that match a part of a pattern."""
    found = [""]
    for operation, value in items:
        match str(operation):
            case "LITERAL":
                texts = [chr(value)]
            case "IN":
                texts = characters(value)
            case "ANY" | "NOT_LITERAL":
                texts = characters([(operation, value), ("LITERAL", value or 0)])
            case "MAX_REPEAT" | "MIN_REPEAT":
                texts = samples(value[2])
            case "SUBPATTERN":
                texts = samples(value[3])
            case "BRANCH":
                texts = [text for branch in value[1] for text in samples(branch)]
            case _:
                continue
        found = [before + text for before, text in product(found, texts[:4])][:8]
    return found


def repeated(items: Sequence[tuple[Any, Any]], lead: str = "") -> Iterator[tuple[str, str]]:
    """Yield a text before each repetition in a pattern, and a text that is repeated there."""
    for place, (operation, value) in enumerate(items):
        before = lead + samples(items[:place])[0]
        match str(operation):
            case "MAX_REPEAT" | "MIN_REPEAT":
                if value[1] > COUNTS[0]:
                    yield from ((before, text) for text in samples(value[2]) if text)
                yield from repeated(value[2], before)
            case "SUBPATTERN":
                yield from repeated(value[3], before)
            case "BRANCH":
                for branch in value[1]:
                    yield from repeated(branch, before)
            case "ASSERT" | "ASSERT_NOT":
                yield from repeated(value[1], before)


def use(pattern: re.Pattern[Any], method: str, text: str) -> None:
    content = text.encode("latin-1", "replace") if isinstance(pattern.pattern, bytes) else text
    if method in ("match", "fullmatch", "search"):
        getattr(pattern, method)(content)
    else:
        for _ in pattern.finditer(content):
            pass


def is_costly(pattern: re.Pattern[Any], method: str, text: str) -> bool:
    tracemalloc.start()
    use(pattern, method, text)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak > COSTLY_BYTES * len(text) // COSTLY_CHARACTERS


def is_slow(pattern: re.Pattern[Any], method: str, text: str) -> bool:
    for _ in range(3):
        start = time.process_time()
        use(pattern, method, text)
        if time.process_time() - start < LIMIT_S:
            return False
    return True


def slow_text(pattern: re.Pattern[Any], methods: Iterable[str], *, is_script: bool = False) -> str | None:
    """Return the repetition for which a pattern takes long or much memory, or None."""
    tried = dict.fromkeys(repeated(READER.parse(pattern.pattern, pattern.flags)))
    for (lead, unit), method, is_lead_repeated in product(tried, methods, (False, True)):
        part = lead + unit if is_lead_repeated else unit
        for count in COUNTS:
            if is_slow(pattern, method, lead + part * min(count, MOST_CHARACTERS // len(part)) + "\0"):
                return f"{method} of [{lead}], then many [{part}]"
        if not is_script and all(
            is_costly(pattern, method, lead + part * (count // len(part)) + "\0")
            for count in (MOST_CHARACTERS, COSTLY_CHARACTERS)
        ):
            return f"{method} of [{lead}], then many [{part}], takes memory"
    return None


@pytest.mark.parametrize("folder", ROOTS, ids=lambda folder: str(folder.relative_to(REPOSITORY)))
def test_patterns_are_linear(folder: Path) -> None:
    readers = ("*.py", patterns_in), ("*.js", scripts_patterns_in)
    found = {
        f"{file.relative_to(folder)}:{line}": slow
        for glob, read in readers
        for file in files_below(folder, glob)
        if not {"vendor", "bundle"} & {*file.parts}
        for line, pattern, methods in read(file.read_text(encoding="utf-8"))
        if (slow := slow_text(pattern, methods, is_script=glob == "*.js"))
    }

    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        r're.fullmatch(r"[+-]?(?:\d+\.?\d*|\.\d+)x", text)', r're.search(r"(?m)^\s*source", text)',
        r'A = re.compile(rf"import (?:[\w. ]+, *)*{name}")' "\nA.match(text)", r're.findall(r"\w+!", text)',
        r're.sub(rb"<([^>]*)>", b"", text)', r're.split(r"(?:a+)+b", text)', r're.match(r"(?:ab|c)*d", text)',
    ],
)  # fmt: skip
def test_the_rule_finds_slow_patterns(text: str) -> None:
    assert [slow_text(pattern, methods) is not None for _, pattern, methods in patterns_in(text)] == [True]
