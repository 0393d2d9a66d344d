"""Patterns take time proportional to the text, so that no file and no peer can keep a processor busy."""

from __future__ import annotations

import ast
import importlib
import re
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from tests.support.environments import REPOSITORY, ROOTS, files_below, import_path

COUNTS = (12, 20, 28, 400, 4000)
"""Repetitions. An exponential pattern takes long for few already."""
MOST_CHARACTERS = 4000
LIMIT_S = 0.01
"""A linear pattern reads 4,000 characters in a tenth of a millisecond, a quadratic one in 50 ms, of processor
time. Python's patterns do not count their steps, and a slow one must be slow three times in a row."""

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


def is_slow(pattern: re.Pattern[Any], method: str, text: str) -> bool:
    content = text.encode("latin-1", "replace") if isinstance(pattern.pattern, bytes) else text
    for _ in range(3):
        start = time.process_time()
        if method in ("match", "fullmatch", "search"):
            getattr(pattern, method)(content)
        else:
            pattern.sub(content[:0], content)
        if time.process_time() - start < LIMIT_S:
            return False
    return True


def slow_text(pattern: re.Pattern[Any], methods: Iterable[str]) -> str | None:
    """Return the repetition for which a pattern takes long, or None."""
    tried = dict.fromkeys(repeated(READER.parse(pattern.pattern, pattern.flags)))
    for (lead, unit), method, is_lead_repeated in product(tried, methods, (False, True)):
        part = lead + unit if is_lead_repeated else unit
        for count in COUNTS:
            if is_slow(pattern, method, lead + part * min(count, MOST_CHARACTERS // len(part)) + "\0"):
                return f"{method} of [{lead}], then many [{part}]"
    return None


@pytest.mark.parametrize("folder", ROOTS, ids=lambda folder: str(folder.relative_to(REPOSITORY)))
def test_patterns_are_linear(folder: Path) -> None:
    found = {
        f"{import_path(file)}:{line}": slow
        for file in files_below(folder, "*.py")
        if "re." in (text := file.read_text(encoding="utf-8"))
        for line, pattern, methods in patterns_in(text)
        if (slow := slow_text(pattern, methods))
    }

    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        r're.fullmatch(r"[+-]?(?:\d+\.?\d*|\.\d+)x", text)', r're.search(r"(?m)^\s*source", text)',
        r'A = re.compile(rf"import (?:[\w. ]+, *)*{name}")' "\nA.match(text)", r're.findall(r"\w+!", text)',
        r're.sub(rb"<([^>]*)>", b"", text)', r're.split(r"(?:a+)+b", text)',
    ],
)  # fmt: skip
def test_the_rule_finds_slow_patterns(text: str) -> None:
    assert [slow_text(pattern, methods) is not None for _, pattern, methods in patterns_in(text)] == [True]
