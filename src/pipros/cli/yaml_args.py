"""Values that people type or pipe into commands, as YAML."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pipros.safe.yaml import load

SEPARATOR = "---"


def value_of(word: str) -> Any:
    """The value of a word of a command line. Nothing is the empty text, not null.

    Raises:
        YamlError: it is not valid YAML.
    """
    return load(word, "argument", angles=False) if word else ""


def documents_of(lines: Iterable[str], file: str = "standard input") -> Iterator[Any]:
    """The documents among the lines, each as soon as its separator arrives; empty ones are left out.

    So a pipe can stay open: `rostopic echo /a | rostopic pub /b std_msgs/String`.

    Raises:
        YamlError: one of them is not valid YAML.
    """
    kept: list[str] = []
    for line in lines:
        if line.strip() != SEPARATOR:
            kept.append(line)
            continue
        document, kept = load("".join(kept), file, angles=False), []
        if document is not None:
            yield document
    document = load("".join(kept), file, angles=False)
    if document is not None:
        yield document
