"""The list of topics with rates, and the newest message of one topic."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import re
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from typing import Any

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.time import TVal
from pipros.node.any_msg import AnyMsg
from pipros_page.bounded_list import bounded_list
from pipros_page.messages.known_topic import LONGEST_NAME
from pipros_page.messages.picture import message_picture
from pipros_page.topic_watch import Newest, TopicWatch
from pipros_page.traffic import STATIC_TOPIC, TopicTraffic, topic_traffic
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.message_tree import message_tree
from pipros_tools.graph.observer import GraphObservation

LONGEST_REQUESTED = 1000
"""Maximum length of a requested name, in characters."""
LARGEST_COPIED_BYTES = 1_000_000
"""Maximum size of a serialized message that is sent as text."""
LONGEST_DEFINITION = 200_000
"""Maximum length of a definition, in characters."""
MAX_MEASURED = 50
"""Maximum number of topics that a browser can measure at a time."""
MEASURED_INTERVAL_S = 1.0
UPDATE_INTERVAL_S = 0.1
"""Minimum interval (s) between messages sent to a browser."""

_PERCENTAGE = re.compile(r"\s*%\s*(\d{1,3}(?:\.\d+)?)\s*|\s*(\d{1,3}(?:\.\d+)?)\s*%\s*")


class TopicViews:
    """The views of the Topics tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def topics(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the list of topics after each observation: types, nodes and, if known, rates (Hz)."""
        async for observation in self._system.observations():
            traffic = topic_traffic(observation, self._system.topics.watches())
            rows = topic_rows(observation, self._system.activity.stale(), self._system.node.name, traffic)
            yield {"topics": bounded_list(rows), "error": observation.error}

    async def topic(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the newest message, rate and bandwidth of one topic, after new messages and periodically."""
        name = topic_name(arguments)
        with self._system.topics.watch(name) as watch:
            number = -1
            ticks = 0
            pause_s = UPDATE_INTERVAL_S
            while True:
                newest = watch.newest
                is_new = newest is not None and newest.number != number
                if is_new or ticks % 10 == 0:
                    values: dict[str, Any] = {"name": name, **_figures(watch), **self._registered(name)}
                    if newest is not None:
                        number = newest.number
                        begin_s = time.monotonic()
                        values |= await self._system.computations.run(_shown, watch, newest)
                        pause_s = max(UPDATE_INTERVAL_S, time.monotonic() - begin_s)
                    yield values
                ticks += 1
                await asyncio.sleep(pause_s)

    async def measured(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Subscribe to up to `MAX_MEASURED` topics, and yield their rates and bandwidths every second."""
        chosen = arguments.get("names")
        if not isinstance(chosen, list) or len(chosen) > MAX_MEASURED:
            raise RequestRefused(f"names must be a list of at most {MAX_MEASURED} topics")
        with contextlib.ExitStack() as stack:
            watches = [
                stack.enter_context(self._system.topics.watch(topic_name({"name": name}))) for name in chosen
            ]
            while True:
                yield {"topics": {watch.topic: _figures(watch) for watch in watches}}
                await asyncio.sleep(MEASURED_INTERVAL_S)

    async def message_text(self, arguments: Mapping[str, object]) -> str:
        """Return the complete newest message of a topic that a browser watches, as YAML or JSON.

        Raises:
            RequestRefused: no message has been received, or the message is too large.
        """
        name, form = topic_name(arguments), arguments.get("format", "yaml")
        if form not in ("yaml", "json"):
            raise RequestRefused(f"format must be yaml or json, got {form!r:.100}")
        with self._system.topics.watch(name) as watch:
            newest = watch.newest
            if newest is None:
                raise RequestRefused(f"no message has been received on {name} yet")
            if len(newest.message.body) > LARGEST_COPIED_BYTES:
                size = len(newest.message.body)
                raise RequestRefused(
                    f"cannot copy a message of {size} bytes; the limit is {LARGEST_COPIED_BYTES}"
                )
            return await self._system.computations.run(_text_of, watch, newest.message, form)

    async def definition(self, arguments: Mapping[str, object]) -> str:
        """Return the definition of a topic's type, with comments and the definitions of embedded types.

        If a message has been received, return its publisher's definition; otherwise the installed one.
        """
        name = topic_name(arguments)
        with self._system.topics.watch(name) as watch:
            newest = watch.newest
            sent = newest.message.header.get("message_definition", "") if newest else ""
        if sent:
            return sent[:LONGEST_DEFINITION]
        kind = self._system.observation.types.get(name, "")
        found = await self._system.computations.run(load_message_class, kind)
        definition: str = found._full_text
        return definition[:LONGEST_DEFINITION]

    def _registered(self, name: str) -> Mapping[str, Any]:
        observation = self._system.observation
        state = observation.state
        return {
            "type": observation.types.get(name, ""),
            "wrong": _wrong_types(observation).get(name, ""),
            "publishers": bounded_list(state.publishers.get(name, ()), share=50),
            "subscribers": bounded_list(state.subscribers.get(name, ()), share=50),
        }


def _figures(watch: TopicWatch) -> Mapping[str, Any]:
    return {**watch.figures(), "latched": watch.is_latched or watch.topic == STATIC_TOPIC}


def _shown(watch: TopicWatch, newest: Newest) -> dict[str, Any]:
    header = newest.message.header
    values: dict[str, Any] = {
        "stamp": newest.wall_s,
        "from": header.get("callerid", "")[:LONGEST_NAME],
        "bytes": len(newest.message.body),
    }
    if "type" in header:
        values["type"] = header["type"][:LONGEST_NAME]
    try:
        message = watch.decode(newest.message)
    except PiprosError as error:
        return {**values, "error": str(error)}
    shown = {"message": message_tree(message, for_browser=True), "gauge": percentage(message)}
    return {**values, **shown, "picture": message_picture(message)}


def _text_of(watch: TopicWatch, message: AnyMsg, form: str) -> str:
    decoded = watch.decode(message)
    return str(decoded) if form == "yaml" else json.dumps(plain_values(decoded), indent=2)


def plain_values(value: Any) -> Any:
    """Return a field or a message as JSON values. NaN and infinity become None."""
    if isinstance(value, TVal):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if hasattr(value, "_slot_types"):
        return {name: plain_values(getattr(value, name)) for name in value.__slots__}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (bytes, bytearray, memoryview, list, tuple)):
        return [plain_values(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def topic_name(arguments: Mapping[str, object]) -> str:
    """Return the requested topic name. Raise `RequestRefused` if it is not a global name."""
    name = arguments.get("name")
    if not isinstance(name, str) or not names.is_legal(name) or not names.is_global(name):
        raise RequestRefused(f"name must be a global name such as /battery_topic, got {name!r:.100}")
    if len(name) > LONGEST_REQUESTED:
        raise RequestRefused(f"name must have at most {LONGEST_REQUESTED} characters, got {len(name)}")
    return names.canonicalize(name)


def topic_rows(
    observation: GraphObservation,
    stale: Mapping[str, float] | None = None,
    own: str = "",
    traffic: Mapping[str, TopicTraffic] | None = None,
) -> Iterator[Mapping[str, Any]]:
    """Yield the topics of an observation, except those without publishers to which only `own` subscribes.

    `stale` contains the ages (s) of the stale topics, and `traffic` defaults to that of the observation.
    """
    traffic = topic_traffic(observation) if traffic is None else traffic
    state = observation.state
    wrong = _wrong_types(observation)
    for topic in state.topics():
        if not state.publishers.get(topic) and list(state.subscribers.get(topic, ())) == [own]:
            continue
        known = traffic.get(topic, TopicTraffic())
        yield {
            "name": topic,
            "type": observation.types.get(topic, "*"),
            "publishers": list(state.publishers.get(topic, ())),
            "subscribers": list(state.subscribers.get(topic, ())),
            "rate": None if known.rate is None else round(known.rate, 2),
            "bandwidth": None if known.bandwidth is None else round(known.bandwidth, 1),
            "latched": known.is_latched,
            "wrong": wrong.get(topic, ""),
            "stale": (stale or {}).get(topic),
        }


def _wrong_types(observation: GraphObservation) -> Mapping[str, str]:
    """Return, by topic, which type a node sends and which other type a node wants."""
    return {
        each.topic: f"{each.publisher} sends {types.sent}, {each.subscriber} wants {types.wanted}"
        for each, types in observation.wrong_types.items()
    }


def percentage(message: object) -> float | None:
    """Return the percentage in a battery message, from 0 to 100, or None if it is missing or invalid.

    `sensor_msgs/BatteryState.percentage` is defined as a fraction from 0 to 1. A message whose only field is
    a string such as `%25` or `80 %` counts as a battery message, too.
    """
    fraction = getattr(message, "percentage", None)
    if isinstance(fraction, float):
        return round(fraction * 100, 1) if 0.0 <= fraction <= 1.0 else None
    slots: Sequence[str] = getattr(message, "__slots__", ())
    if len(slots) != 1 or not isinstance(text := getattr(message, slots[0], None), str):
        return None
    found = _PERCENTAGE.fullmatch(text)
    value = float(found[1] or found[2]) if found else -1.0
    return value if 0.0 <= value <= 100.0 else None
