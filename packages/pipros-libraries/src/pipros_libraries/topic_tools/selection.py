"""The topics of a mux or demux, and the selected topic."""

from __future__ import annotations

from collections.abc import Iterable

from pipros.basics.errors import PiprosError
from pipros.basics.names import is_legal

NONE = "__none"
"""The name that selects no topic."""

_SPACE = 65_536
"""Limit: the characters in the names of all topics, because any node can add some."""


class BadSelection(PiprosError):
    """A topic cannot be added, deleted or selected."""


class Selection:
    """An ordered set of topics, of which at most one is selected. Not thread-safe.

    Attributes:
        selected: the selected topic, or an empty string.
    """

    def __init__(self, topics: Iterable[str], owner: str) -> None:
        """Add the topics and select the first one.

        Args:
            topics: global names; duplicates are ignored.
            owner: `mux` or `demux`, for error messages.
        """
        self._topics = list(dict.fromkeys(topics))
        self._owner = owner
        self.selected = self._topics[0] if self._topics else ""

    @property
    def topics(self) -> list[str]:
        return list(self._topics)

    def select(self, topic: str) -> str:
        """Select a topic, or no topic if `topic` is `__none`.

        Return the previous selection, or `""` if there was none.

        Raises:
            BadSelection: `topic` is not one of the topics.
        """
        if topic == NONE:
            topic = ""
        elif topic not in self._topics:
            known = ", ".join(self._topics) or "none"
            raise BadSelection(f"{topic} is not a topic of the {self._owner}; its topics are: {known}")
        before, self.selected = self.selected, topic
        return before

    def add(self, topic: str) -> None:
        """Append a topic.

        Raises:
            BadSelection: `topic` is already one of the topics, reserved, or not a valid name, or there is no
                room for it.
        """
        if topic.endswith(NONE):
            raise BadSelection(
                f"{topic} cannot be a topic of the {self._owner}: {NONE} is reserved to select no topic"
            )
        if not topic.strip("/") or not is_legal(topic):
            raise BadSelection(f"{topic!r} is not a valid topic name")
        if topic in self._topics:
            raise BadSelection(f"{topic} is already a topic of the {self._owner}")
        if len(topic) + sum(map(len, self._topics)) > _SPACE:
            raise BadSelection(f"the names of the {self._owner}'s topics have more than {_SPACE} characters")
        self._topics.append(topic)

    def delete(self, topic: str) -> None:
        """Remove a topic.

        Raises:
            BadSelection: `topic` is not one of the topics, or is currently selected.
        """
        if topic not in self._topics:
            raise BadSelection(f"{topic} is not a topic of the {self._owner}")
        if topic == self.selected:
            raise BadSelection(f"{topic} is selected; select another topic of the {self._owner} first")
        self._topics.remove(topic)
