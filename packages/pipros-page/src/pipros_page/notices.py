"""Recent changes in a system: sources that became stale or recovered, and errors."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

SHOWN_S = 60.0
MAX_NOTICES = 200
MAX_STALE = 200
"""Maximum number of stale sources that are listed; all are counted."""
LONGEST_TEXT = 300

Kind = Literal["frame", "topic", "component", "node"]
What = Literal["stale", "back", "error"]


@dataclass(frozen=True, slots=True)
class PageNotice:
    """A source's change of state, or an error.

    Attributes:
        when_s: wall time (s) of the change; for a repeated error, of its last occurrence.
        kind, name: the source: a frame, a topic, a component that reports diagnostics, or a node.
        text: text of an error; empty for other changes.
        count: number of times that the error occurred.
    """

    when_s: float
    what: What
    kind: Kind
    name: str
    text: str = ""
    count: int = 1


class Notices:
    """Compares the states of sources, and keeps the changes of the last minute. Not thread-safe."""

    def __init__(self) -> None:
        self._notices: deque[PageNotice] = deque(maxlen=MAX_NOTICES)
        self._stale: dict[tuple[Kind, str], float] = {}
        self._failing: dict[tuple[Kind, str], str] = {}

    def note_stale(self, kind: Kind, ages_s: Mapping[str, float], now_s: float) -> None:
        """Note which sources of a kind have become stale or recovered.

        `ages_s` contains the ages of all stale sources of this kind.
        """
        before = {name for of_kind, name in self._stale if of_kind == kind}
        for name in sorted(ages_s.keys() - before):
            self._stale[kind, name] = now_s - ages_s[name]
            self._notices.append(PageNotice(now_s, "stale", kind, name))
        for name in sorted(before - ages_s.keys()):
            del self._stale[kind, name]
            self._notices.append(PageNotice(now_s, "back", kind, name))

    def forget(self, kind: Kind, names: set[str]) -> None:
        """Forget stale sources that no longer exist, without noting a recovery."""
        for name in names:
            self._stale.pop((kind, name), None)

    def note_failing(self, kind: Kind, texts: Mapping[str, str], now_s: float) -> None:
        """Note an error for each source that has begun to fail.

        `texts` contains the reasons for all sources of this kind that are failing now.
        """
        before = {name for of_kind, name in self._failing if of_kind == kind}
        for name in sorted(texts.keys() - before):
            self._failing[kind, name] = texts[name]
            self.note_error(kind, name, texts[name], now_s)
        for name in before - texts.keys():
            del self._failing[kind, name]

    def note_error(self, kind: Kind, name: str, text: str, when_s: float) -> None:
        """Add an error. If it repeats an error from the last minute, only count it."""
        notice = PageNotice(when_s, "error", kind, name, text[:LONGEST_TEXT])
        for each in self._notices:
            if (each.what, each.kind, each.name, each.text) == ("error", kind, name, notice.text):
                self._notices.remove(each)
                notice = replace(notice, count=each.count + 1)
                break
        self._notices.append(notice)

    def recent(self, now_s: float) -> list[PageNotice]:
        """Return the changes of the last minute, newest first, and forget older changes."""
        recent = [each for each in self._notices if now_s - each.when_s < SHOWN_S]
        self._notices = deque(recent, MAX_NOTICES)
        return recent[::-1]

    def stale(self) -> list[tuple[Kind, str, float]]:
        """Return the kind and name of each stale source, and the time of its last data, newest first."""
        return sorted(((*key, since_s) for key, since_s in self._stale.items()), key=lambda each: -each[2])
