"""YAML values on command lines and in pipes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pipros.safe.yaml import load

SEPARATOR = "---"


def value_of(word: str) -> Any:
    """The value of a word of a command line. An empty word is the empty string, not null.

    Raises:
        YamlError: it is not valid YAML.
    """
    return load(word, "argument", angles=False) if word else ""


def documents_of(lines: Iterable[str], file: str = "standard input") -> Iterator[Any]:
    """The documents in the lines, each as soon as its separator arrives; empty ones are skipped.

    So a pipe may stay open: `rostopic echo /a | rostopic pub /b std_msgs/String`.

    Raises:
        YamlError: one of them is not valid YAML.
    """
    pending: list[str] = []
    for line in lines:
        if line.strip() != SEPARATOR:
            pending.append(line)
            continue
        document, pending = load("".join(pending), file, angles=False), []
        if document is not None:
            yield document
    document = load("".join(pending), file, angles=False)
    if document is not None:
        yield document
