"""The examples of docs/guides/package.md run, and its limits are those of the code."""

import re

from pipros.msg.compile.emitter import BLOCK_LIMIT
from pipros.msg.language.digest import DEPTH_LIMIT
from tests.support import documents

DOCUMENT = documents.text_of("guides/package.md")


def test_the_examples_run() -> None:
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert len(examples) == 4
    names: dict[str, object] = {}
    for example in examples:
        exec(example, names)  # noqa: S102 # our own document


def test_the_documented_nesting_limits_are_those_of_the_code() -> None:
    text = " ".join(DOCUMENT.split())

    assert f"nested {DEPTH_LIMIT} levels deep, and arrays within arrays {BLOCK_LIMIT} levels deep." in text
