"""Tools for the bags below a folder that the user specifies when starting the server."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field

from pipros.basics.files_below import file_inside, files_below
from pipros.basics.plugins import offered
from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import (
    ASSISTANT_CALL_S,
    ASSISTANT_PICTURE_BYTES,
    ASSISTANT_SAMPLE_BYTES,
    RobotAccess,
)
from pipros_assistants.tools.arguments import Cursor, Name, Part
from pipros_assistants.values import conditions_of, fulfils, has_text, part_of, shown, steps_of
from pipros_libraries.pictures.drawn import colours, plot
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_tree
from pipros_tools.bag.opening import open_bag
from pipros_tools.bag.reader import BagReader
from pipros_tools.graph.value_statistics import numbers_in, summaries

ASSISTANT_QUERY_S = 30.0
"""Limit: elapsed time of an SQL query, and its processor time. Beyond it, the process that runs the query is
ended, which the answer reports.
"""
ASSISTANT_QUERY_BYTES = 4096 * 1024 * 1024
"""Limit: memory of an SQL query's process, and of each file that it writes. Beyond it, the query fails."""

SUFFIXES: Final = (".bag", ".mcap")
ROWS: Final = 100
PLOT_POINTS: Final = 3000
"""Maximum number of messages that are decoded for a plot or for statistics."""

Seconds = Annotated[float, Field(ge=0.0, le=1e9, description="seconds after the bag's first message")]
Bag = Annotated[str, Field(min_length=1, max_length=500, description="a name from list_bags")]


class BagTools:
    """Tools for bags."""

    def __init__(self, robot: RobotAccess, folder: Path | None) -> None:
        self._robot = robot
        self._folder = folder

    def list_bags(self, cursor: Cursor = 0) -> Answer:
        """List the bags and MCAP files below the folder that the user allowed."""
        rows = list(files_below(self._root(), SUFFIXES))
        return Answer(rows, figures={"bags": len(rows)})

    def describe_bag(self, bag: Bag, cursor: Cursor = 0) -> Answer:
        """Describe a bag: start, end, size, and the topics with their types and numbers of messages."""
        with self._opened(bag) as reader:
            tree = info_tree(bag_info(reader, bag))
        topics = tree.pop("topics", [])
        types = tree.pop("types", [])
        return Answer([tree, *topics, {"types": [each["type"] for each in types[:200]]}])

    def read_bag(
        self,
        bag: Bag,
        topic: Name,
        part: Part = "",
        start_s: Seconds = 0.0,
        end_s: Seconds = 1e9,
        every: Annotated[int, Field(ge=1, le=1_000_000, description="take every n-th message")] = 1,
        contains: Annotated[
            str, Field(max_length=500, description="only messages with this in a text, in any case")
        ] = "",
        where: Annotated[
            str,
            Field(
                max_length=500,
                description="only messages for which this is true: level >= 8, or name == 'door' and x < 2.5",
            ),
        ] = "",
        cursor: Cursor = 0,
    ) -> Answer:
        """Read messages on a topic in a bag, with their times in seconds after the bag's first message. Long
        arrays are shortened; name a part of the messages to see more of it. contains and where select among
        the messages that the other arguments leave."""
        steps, conditions = steps_of(part), conditions_of(where)
        is_filtered = bool(contains or conditions)
        with self._opened(bag) as reader:
            chosen = self._messages(reader, topic, start_s, end_s, every, 0 if is_filtered else cursor)
            fitting = (
                (time_s, message)
                for time_s, message in chosen
                if has_text(message, contains.casefold()) and fulfils(message, conditions)
            )
            begin = cursor if is_filtered else 0
            rows = [
                {"time_s": round(time_s, 6), "message": shown(part_of(message, steps), 20)}
                for time_s, message in islice(fitting, begin, begin + ROWS + 1)
            ]
        return Answer(rows[:ROWS], begin=cursor, has_more=len(rows) > ROWS)

    def summarize_bag(
        self,
        bag: Bag,
        topic: Name,
        part: Part = "",
        start_s: Seconds = 0.0,
        end_s: Seconds = 1e9,
        cursor: Cursor = 0,
    ) -> Answer:
        """Compute the minimum, maximum, mean and standard deviation of each number in a topic's messages in a
        bag. If there are many messages, only every n-th is used."""
        steps = steps_of(part)
        with self._opened(bag) as reader:
            chosen, every = self._thinned(reader, topic, start_s, end_s)
            rows = summaries(part_of(message, steps) for _, message in chosen)
        return Answer(rows, figures={"every": every})

    def plot_bag(
        self,
        bag: Bag,
        topic: Name,
        parts: Annotated[
            list[Annotated[str, Field(max_length=500)]],
            Field(min_length=1, max_length=6, description="numbers such as pose.position.x or ranges[0]"),
        ],
        start_s: Seconds = 0.0,
        end_s: Seconds = 1e9,
    ) -> Answer:
        """Plot numbers from a topic in a bag over time, as a picture. data contains the colour and the range
        of each curve."""
        steps = {part: steps_of(part) for part in parts}
        lines: dict[str, list[tuple[float, float]]] = {part: [] for part in parts}
        with self._opened(bag) as reader:
            chosen, every = self._thinned(reader, topic, start_s, end_s)
            for time_s, message in chosen:
                for part in parts:
                    value = next((number for _, number in numbers_in(part_of(message, steps[part]))), None)
                    if value is None:
                        raise ToolRefused("this part of the messages is not a number", part)
                    if abs(value) < float("inf"):
                        lines[part].append((time_s, value))
        if not any(lines.values()):
            raise ToolRefused("these messages have no finite values to plot")
        drawn = colours(parts)
        rows = [
            {"part": part, "colour": drawn[part], "points": len(line), "min": min(values), "max": max(values)}
            for part, line in lines.items()
            if (values := [y for _, y in line])
        ]
        picture = plot(lines, ASSISTANT_PICTURE_BYTES)
        return Answer(rows, figures={"every": every}, pictures=[picture])

    def show_bag(self, bag: Bag, topic: Name, at_s: Seconds = 0.0) -> Answer:
        """Show a topic's first message at or after a time in a bag as a picture: an image, a point cloud, a
        laser scan, a path or an occupancy grid."""
        with self._opened(bag) as reader:
            found = next(self._messages(reader, topic, at_s, 1e9), None)
        if found is None:
            raise ToolRefused("the topic has no message at or after this time")
        picture, note, facts = self._robot.draw(found[1])
        return Answer([{"time_s": round(found[0], 6), **facts}], note, pictures=[picture])

    def query_bag(
        self,
        bag: Bag,
        sql: Annotated[str, Field(min_length=1, max_length=20_000, description="one SELECT")],
        cursor: Cursor = 0,
    ) -> Answer:
        """Query a bag with SQL (DuckDB). A table is named after its topic, as "/imu/data" or imu_data; its
        columns are the fields, such as "header.stamp", and "_time", the time of receipt in ns. Rows are lists
        of strings; the first row contains the names of the columns."""
        run_query = offered("limited_query")
        if run_query is None:
            raise ToolRefused("this installation of pipros lacks SQL over bags")
        text = run_query(self._file(bag), sql, limit_s=ASSISTANT_QUERY_S, limit_bytes=ASSISTANT_QUERY_BYTES)
        return Answer(list(csv.reader(io.StringIO(text))))

    def _root(self) -> Path:
        if self._folder is None:
            raise ToolRefused("the user has not allowed a folder: pipros mcp --bags FOLDER")
        return self._folder

    def _file(self, bag: str) -> Path:
        if not bag.endswith(SUFFIXES):
            raise ToolRefused("the name of a bag must end in .bag or .mcap", bag)
        return file_inside(self._root(), bag)

    @contextmanager
    def _opened(self, bag: str) -> Iterator[BagReader]:
        with open_bag(self._file(bag)) as reader:
            yield reader

    def _messages(
        self, reader: BagReader, topic: str, start_s: float, end_s: float, every: int = 1, skip: int = 0
    ) -> Iterator[tuple[float, Any]]:
        """Yield every n-th message of a topic with its time, without the first `skip` of these messages.

        Raises:
            ToolRefused: the bag lacks the topic, or a limit is reached.
        """
        connections = reader.connections_of(topic)
        if not connections:
            known = {each.topic for each in reader.connections}
            raise ToolRefused("the bag does not have this topic; describe_bag lists its topics", topic, known)
        deadline_s = time.monotonic() + ASSISTANT_CALL_S / 2
        left = ASSISTANT_SAMPLE_BYTES * 4
        begin = reader.range_ns[0]
        stored = reader.stored_messages(connections, begin + int(start_s * 1e9), begin + int(end_s * 1e9))
        for number, each in enumerate(stored):
            left -= len(each.data)
            if left < 0 or time.monotonic() > deadline_s:
                raise ToolRefused("the bag has too much data for one call; choose a shorter time")
            if number % every == 0 and number >= skip * every:
                yield (each.time_ns - begin) / 1e9, reader.decode(each)

    def _thinned(
        self, reader: BagReader, topic: str, start_s: float, end_s: float
    ) -> tuple[Iterator[tuple[float, Any]], int]:
        counts = reader.count_by_connection()
        total = sum(counts.get(each.id, 0) for each in reader.connections_of(topic))
        every = max(-(-total // PLOT_POINTS), 1)
        return self._messages(reader, topic, start_s, end_s, every), every
