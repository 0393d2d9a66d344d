"""Tools for the messages of topics."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import RobotAccess, decoded
from pipros_assistants.tools.arguments import Cursor, Name, Part, Wait
from pipros_assistants.values import part_of, shown, steps_of
from pipros_tools.graph.value_statistics import summaries


class TopicTools:
    """Tools for the messages of topics."""

    def __init__(self, robot: RobotAccess) -> None:
        self._robot = robot

    def read_topic(
        self,
        topic: Name,
        part: Part = "",
        count: Annotated[int, Field(ge=1, le=20, description="number of messages")] = 1,
        every: Annotated[int, Field(ge=1, le=10_000, description="take every n-th message")] = 1,
        wait_s: Wait = 5.0,
    ) -> Answer:
        """Receive one message on a topic, or a few. Long arrays are shortened; name a part of the messages
        to see more of it. Use show_topic for images, clouds and maps."""
        name, kind = self._robot.type_of(topic)
        steps = steps_of(part)
        needed = (count - 1) * every + 1
        samples = self._robot.sample([name], wait_s, lambda received: len(received) >= needed)
        rows = [
            {
                "received_s": round(received.time_s, 6),
                "from": received.raw.header.get("callerid", ""),
                "message": shown(part_of(message, steps), count),
            }
            for received, message in decoded(samples.received[::every])
        ]
        self._check(len(samples.received), len(rows))
        return Answer([{"topic": name, "type": kind}, *rows], figures={"messages": len(rows)})

    def summarize_topic(
        self, topic: Name, part: Part = "", seconds: Wait = 5.0, cursor: Cursor = 0
    ) -> Answer:
        """Measure a topic for a few seconds: its rate and bandwidth, and the minimum, maximum, mean and
        standard deviation of each number in its messages."""
        name, _ = self._robot.type_of(topic)
        steps = steps_of(part)
        samples = self._robot.sample([name], seconds)
        received = samples.received
        size = sum(len(each.raw.body) for each in received)
        rows = summaries(part_of(message, steps) for _, message in decoded(received))
        self._check(len(received), len(received))
        span_s = received[-1].time_s - received[0].time_s
        figures = {
            "messages": len(received),
            "rate_hz": round((len(received) - 1) / span_s, 3) if span_s > 0 else None,
            "bytes_per_s": round(size / samples.seconds),
        }
        note = "The messages reached the limit in bytes before the time was over." if samples.is_full else ""
        return Answer(rows, note, figures)

    def show_topic(self, topic: Name, wait_s: Wait = 5.0) -> Answer:
        """Receive a message on a topic, and show it as a picture: an image, an occupancy grid, or a point
        cloud, laser scan or path seen from above."""
        name, kind = self._robot.type_of(topic)
        samples = self._robot.sample([name], wait_s, bool)
        message: Any = next((message for _, message in decoded(samples.received)), None)
        self._check(len(samples.received), message is not None)
        picture, note, facts = self._robot.draw(message)
        return Answer([{"topic": name, "type": kind, **facts}], note, pictures=[picture])

    def _check(self, received: int, known: int) -> None:
        if not received:
            raise ToolRefused("no message arrived during the wait; why_no_data finds the reason")
        if not known:
            raise ToolRefused("the messages do not match their definition, or the definition is unknown")
