"""Decode well-known topics such as `/tf`.

Views access the fields of these messages by name, so publishers must use the installed definition.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros_page.topic_watch import TopicWatch

SHOWN_S = 5.0
"""How long a problem is shown after the last affected message."""
LONGEST_NAME = 300
"""Maximum length of names in messages, in characters; longer names are truncated."""

Take = Callable[[Any, AnyMsg, float], object]
"""Called in the link's thread with the decoded and the serialized message, and the wall time (s)."""


class KnownTopic:
    """Decodes the messages of a topic and passes them to `take`."""

    def __init__(self, watch: TopicWatch, type_name: str, take: Take) -> None:
        self._watch = watch
        self._class = load_message_class(type_name)
        self._take = take
        self._problem = "", 0.0

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Pass messages to `take` within the context; see `TopicWatch.listening` with `from_newest`."""
        with self._watch.listening(self._add, from_newest=True):
            yield

    @property
    def problem(self) -> str:
        """Why messages were skipped in the last `SHOWN_S` seconds; empty if none was skipped."""
        text, last_s = self._problem
        return text if time.time() - last_s < SHOWN_S else ""

    def _add(self, message: AnyMsg, wall_s: float) -> None:
        try:
            decoded = self._watch.decode_as(message, self._class)
        except PiprosError as error:
            self._problem = str(error), wall_s
            return
        self._take(decoded, message, wall_s)
