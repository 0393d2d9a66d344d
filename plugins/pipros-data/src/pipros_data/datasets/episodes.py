"""Find the episodes of a bag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.msg.bulk.columns import TextColumn
from pipros.safe.settings import BadSettings

if TYPE_CHECKING:
    from pipros_data.bags import Bags
    from pipros_data.datasets.config import DatasetConfig


@dataclass(frozen=True, slots=True)
class Episode:
    """An episode: the part of a bag from `start` to `end`."""

    number: int  # the number in the data set
    bag: str
    start: int  # time of receipt (ns)
    end: int  # time of receipt (ns)
    task: str  # the task as text; may be empty

    @property
    def name(self) -> str:
        """The name of the episode's files, without a suffix."""
        return f"episode_{self.number:06d}"


def find_episodes(bags: Bags, bag: str, config: DatasetConfig, first: int) -> list[Episode]:
    """Return the episodes of a bag, numbered from `first`.

    A marker topic has the type `std_msgs/Bool` or `std_msgs/String`. True or a non-empty string ends the
    current episode and starts a new one. False, an empty string or the end of the bag ends the current one.

    Raises:
        BadSettings: there is no episode, or the topic of the markers or tasks does not exist or has another
            type.
        BagError: the bag has no messages, or is damaged.
    """
    begin, end = bags.readers[0].range_ns
    spans = [(begin, end, "")] if not config.marker else _marked(bags, bag, config.marker, end)
    tasks = _texts(bags, bag, "task.topic", config.task_topic) if config.task_topic else []
    if not spans:
        raise BadSettings(f"episodes: no message on {config.marker} in {bag} begins an episode")
    found: list[Episode] = []
    for start, stop, text in spans:
        task = config.task or str(text)
        for time, value in tasks:
            if time <= stop:
                task = str(value)  # the last task before the episode's end applies
        found.append(Episode(first + len(found), bag, start, stop, task))
    return found


def _marked(bags: Bags, bag: str, topic: str, end: int) -> list[tuple[int, int, str]]:
    spans, start, text = [], -1, ""
    for time, value in [*_texts(bags, bag, "episodes", topic), (end, "")]:
        if start >= 0 and time > start:
            spans.append((start, time, text))
        start, text = (time, value if isinstance(value, str) else "") if value else (-1, "")
    return spans


def _texts(bags: Bags, bag: str, key: str, topic: str) -> list[tuple[int, Any]]:
    """Return the times and values of a topic."""
    if topic not in bags.topics():
        raise BadSettings(f"{key}: {bag} has no topic {topic}. The topics are {', '.join(bags.topics())}")
    table = bags.table(topic)
    values: Any = table.get("data")
    is_bool = isinstance(values, np.ndarray) and values.dtype == np.bool_
    if not is_bool and not isinstance(values, TextColumn):
        raise BadSettings(f"{key}: {topic} must be std_msgs/String or std_msgs/Bool, got {table.type}")
    return list(zip(table.times().tolist(), list(values), strict=True))
