"""Users' notes about moments in a bag, stored in `BAG.notes.yaml` beside the bag.

    notes:
    - time: 1763980012.5
      text: the left wheel slips

Times are in seconds since 1970, like message times in the bag.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import yaml

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.replaced_file import replaced_file
from pipros.safe.yaml import load

PAGE_NOTES_BYTES = 262_144
"""Limit: the file of a bag's notes. Beyond it, notes about a bag are neither read nor added."""

ENDING: Final = ".notes.yaml"
LONGEST_TEXT: Final = 1000


class BadNotes(PiprosError, ValueError):
    """A note or a file of notes is malformed or too large, or the file cannot be read or written."""


@dataclass(frozen=True, slots=True)
class Note:
    """A note. `time` is in seconds since 1970.

    Raises:
        BadNotes: a field is invalid.
    """

    time: float
    text: str

    def __post_init__(self) -> None:
        if isinstance(self.time, bool) or not isinstance(self.time, int | float):
            raise BadNotes(f"the time of a note must be a number of seconds, got {self.time!r:.100}")
        if not 0 <= self.time < math.inf:
            raise BadNotes(f"the time of a note must be >= 0, got {self.time}")
        if not isinstance(self.text, str) or not self.text.strip() or len(self.text) > LONGEST_TEXT:
            rule = f"a note must have 1 to {LONGEST_TEXT} characters, and not only spaces"
            raise BadNotes(f"{rule}; got {self.text!r:.100}")
        try:
            self.text.encode()
        except UnicodeEncodeError:  # an unpaired surrogate, which JSON permits but YAML does not
            raise BadNotes(f"a note must be valid Unicode, got {self.text!a:.100}") from None


class BagNotes:
    """The notes about a bag, sorted by time. All methods block. Not thread-safe.

    A file that does not contain notes is never replaced.
    """

    def __init__(self, bag: Path) -> None:
        self.path: Final = bag.with_name(bag.name + ENDING)

    def read(self) -> list[Note]:
        """Return all notes; none if there is no file. Raise `BadNotes` if it is unreadable or malformed."""
        limit = PAGE_NOTES_BYTES
        try:
            if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
                raise BadNotes(f"{self.path} is not a regular file")
            with open_file(self.path) as file:
                content = file.read(limit + 1)
        except FileNotFoundError:
            return []
        except OSError as error:
            raise BadNotes(f"cannot read {self.path}: {error.strerror}") from None
        if len(content) > limit:
            raise BadNotes(f"{self.path} is too large; the limit is {limit} bytes")
        return _notes_in(content, str(self.path))

    def add(self, note: Note) -> list[Note]:
        """Add a note, and return all notes. Raise `BadNotes` if the file cannot be read or written."""
        return self._write([*self.read(), note])

    def remove(self, note: Note) -> list[Note]:
        """Remove a note, and return the other notes. Raise `BadNotes` if the note is missing; see `add`."""
        notes = self.read()
        if note not in notes:
            raise BadNotes(f"the note does not exist in {self.path}")
        notes.remove(note)
        return self._write(notes)

    def _write(self, notes: Sequence[Note]) -> list[Note]:
        ordered = sorted(notes, key=lambda each: each.time)
        rows = [asdict(each) for each in ordered]
        content = yaml.safe_dump({"notes": rows}, sort_keys=False, allow_unicode=True).encode()
        limit = PAGE_NOTES_BYTES
        if len(content) > limit:
            raise BadNotes(f"{self.path} would be too large; the limit is {limit} bytes")
        try:
            with replaced_file(self.path) as file:
                file.write(content)
        except OSError as error:
            raise BadNotes(f"cannot write {self.path}: {error.strerror}") from None
        return ordered


def _notes_in(content: bytes, name: str) -> list[Note]:
    try:
        values: Any = load(content, name)
        if (
            not isinstance(values, dict)
            or values.keys() != {"notes"}
            or not isinstance(values["notes"], list)
        ):
            raise BadNotes("it must have a list named notes, and nothing else")
        notes = [Note(**each) for each in values["notes"]]
    except (PiprosError, TypeError) as error:
        raise BadNotes(f"{name} is not a file of notes: {error}. Correct or move it") from None
    return sorted(notes, key=lambda each: each.time)
