"""The topics of a mux or demux, and which one is selected."""

from __future__ import annotations

from collections.abc import Iterable

from pipros.errors import PiprosError
from pipros.names import is_legal

NONE = "__none"
"""Selects nothing."""


class Refused(PiprosError):
    """A topic cannot be added, deleted or selected."""


class Selection:
    """An ordered set of topics, of which one or none is selected.

    Attributes:
        selected: a topic, or an empty string for none.
    """

    def __init__(self, topics: Iterable[str], owner: str) -> None:
        """Selects the first topic.

        Args:
            topics: global names; one that is there twice counts once.
            owner: `mux` or `demux`, for errors.
        """
        self._topics = list(dict.fromkeys(topics))
        self._owner = owner
        self.selected = self._topics[0] if self._topics else ""

    @property
    def topics(self) -> list[str]:
        return list(self._topics)

    def select(self, topic: str) -> str:
        """Selects a topic, or nothing for `__none`. Returns what was selected before.

        Raises:
            Refused: it is not one of the topics.
        """
        if topic == NONE:
            topic = ""
        elif topic not in self._topics:
            known = ", ".join(self._topics) or "none"
            raise Refused(f"{topic} is not a topic of the {self._owner}; its topics are: {known}")
        before, self.selected = self.selected, topic
        return before

    def add(self, topic: str) -> None:
        """Adds a topic at the end.

        Raises:
            Refused: it is there, or it is not the name of a topic.
        """
        if topic.endswith(NONE):
            raise Refused(f"{NONE} cannot be a topic of the {self._owner}: it stands for no topic")
        if not topic.strip("/") or not is_legal(topic):
            raise Refused(f"{topic!r} is not the name of a topic")
        if topic in self._topics:
            raise Refused(f"{topic} is a topic of the {self._owner} already")
        self._topics.append(topic)

    def delete(self, topic: str) -> None:
        """Removes a topic.

        Raises:
            Refused: it is not one of the topics, or the selected one.
        """
        if topic not in self._topics:
            raise Refused(f"{topic} is not a topic of the {self._owner}")
        if topic == self.selected:
            raise Refused(f"{topic} is selected; select another topic of the {self._owner} first")
        self._topics.remove(topic)
