"""Parse YAML values from command lines and pipes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pipros.basics.limits import limit_text, process_limits
from pipros.safe.yaml import YamlError, load

SEPARATOR = "---"


def value_of(word: str) -> Any:
    """Parse a word from a command line. An empty word is an empty string, not null.

    Raises:
        YamlError: the word is not valid YAML.
    """
    return load(word, "argument", angles=False) if word else ""


def _parts(lines: Iterable[str], size: int) -> Iterator[str]:
    """Yield lines; a line of a file that is longer than `size` may be one without an end."""
    readline = getattr(lines, "readline", None)
    return iter(lines) if readline is None else iter(lambda: readline(size), "")


def documents_of(lines: Iterable[str], file: str = "standard input") -> Iterator[Any]:
    """Yield the documents in the lines, each as soon as its separator arrives. Empty documents are skipped.

    The lines may come from a pipe that stays open: `rostopic echo /a | rostopic pub /b std_msgs/String`.

    Raises:
        YamlError: a document is not valid YAML, or larger than the limit `file_bytes`.
    """
    limit = process_limits().file_bytes
    pending: list[str] = []
    size = 0
    for line in _parts(lines, limit + 1):
        size = size * bool(pending) + len(line)
        if size > limit:
            raise YamlError(file, 0, 0, f"a document is too long; {limit_text('file_bytes', limit)}")
        if line.strip() != SEPARATOR:
            pending.append(line)
            continue
        document, pending = load("".join(pending), file, angles=False), []
        if document is not None:
            yield document
    document = load("".join(pending), file, angles=False)
    if document is not None:
        yield document
