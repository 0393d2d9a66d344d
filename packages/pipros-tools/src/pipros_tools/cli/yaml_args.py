"""Parse YAML values from command lines and pipes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pipros.safe.yaml import load

SEPARATOR = "---"


def value_of(word: str) -> Any:
    """Parse a word from a command line. An empty word is an empty string, not null.

    Raises:
        YamlError: the word is not valid YAML.
    """
    return load(word, "argument", angles=False) if word else ""


def documents_of(lines: Iterable[str], file: str = "standard input") -> Iterator[Any]:
    """Yield the documents in the lines, each as soon as its separator arrives. Empty documents are skipped.

    The lines may come from a pipe that stays open: `rostopic echo /a | rostopic pub /b std_msgs/String`.

    Raises:
        YamlError: a document is not valid YAML.
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
