"""The examples of docs/messages.md run, and its table of limits is true."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

DOCUMENT = (Path(__file__).resolve().parents[3] / "docs" / "messages.md").read_text()


def test_the_examples_run() -> None:
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert len(examples) == 3
    names: dict[str, object] = {}
    for example in examples:
        exec(example, names)  # noqa: S102 # our own document


def test_the_limits_are_those_of_the_code() -> None:
    rows = re.findall(r"^\|[^|]*\| ([\d,]+)( MiB)? \| `([\w.]+)\.([A-Z_]+)` \|$", DOCUMENT, re.MULTILINE)
    assert len(rows) == 7
    for value, mebi, module, name in rows:
        expected = int(value.replace(",", "")) * (1 << 20 if mebi else 1)
        assert getattr(importlib.import_module(module), name) == expected, name
