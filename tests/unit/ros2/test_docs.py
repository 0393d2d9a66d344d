"""The Python examples of docs/ros2.md run."""

from __future__ import annotations

import re
from pathlib import Path

DOCUMENT = (Path(__file__).resolve().parents[3] / "docs" / "ros2.md").read_text()


def test_the_examples_run() -> None:
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert examples

    for example in examples:
        exec(example, {})  # noqa: S102 # our own document
