"""Show and change the parameters of dynamic_reconfigure servers, like `rqt_reconfigure`."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node.open_calls import OpenCalls
from pipros_libraries.reconfigure.config import (
    all_groups,
    change_fields,
    constants,
    decode_config,
    decode_description,
    values,
)
from pipros_page.bounded_list import bounded_list
from pipros_page.service_calls import TOOL_CALL_S
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.service_call import ServiceCaller

POLL_INTERVAL_S = 0.1
ANSWER_S = 10.0
DESCRIPTIONS, UPDATES, SERVICE = "/parameter_descriptions", "/parameter_updates", "/set_parameters"
MAX_BYTES = 1_000_000
"""Maximum size of a server's description and of a configuration, in bytes."""
WHOLE = 2**31 - 1
"""If the bounds of a parameter are at least this far apart, it is shown without bounds."""


class ReconfigureViews:
    """The views of dynamic_reconfigure servers in the Parameters tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def reconfigurable(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the names of all servers after each observation of the system."""
        async for observation in self._system.observations():
            services, publishers = observation.state.services, observation.state.publishers
            names = (name.removesuffix(SERVICE) for name in services if name.endswith(SERVICE))
            yield {
                "servers": bounded_list(sorted(name for name in names if name + DESCRIPTIONS in publishers)),
                "error": observation.error,
            }

    async def reconfigure(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the groups and parameters of one server, and its values, now and whenever they change."""
        name = topic_name(arguments)
        shown: tuple[int, int] = 0, 0
        with ExitStack() as stack:
            described = stack.enter_context(self._system.topics.watch(name + DESCRIPTIONS))
            updates = stack.enter_context(self._system.topics.watch(name + UPDATES))
            while True:
                numbers = _number(described), _number(updates)
                if numbers != shown and all(numbers):
                    is_changed = numbers[0] != shown[0]
                    shown = numbers
                    for each in await self._system.computations.run(_shown, described, updates, is_changed):
                        yield each
                await asyncio.sleep(POLL_INTERVAL_S)

    async def set_reconfigured(self, arguments: Mapping[str, object]) -> Any:
        """Change a server's parameters and group states. Return the new values."""
        name = topic_name(arguments)
        changes, states = arguments.get("changes", {}), arguments.get("states", {})
        if not isinstance(changes, dict) or not isinstance(states, dict):
            raise RequestRefused("changes and states must be objects that map names to values")
        with self._system.topics.watch(name + DESCRIPTIONS) as described:
            end_s = time.monotonic() + ANSWER_S
            while described.newest is None:
                if time.monotonic() > end_s:
                    raise RequestRefused(f"{name} does not describe its parameters")
                await asyncio.sleep(POLL_INTERVAL_S)

            def call(master: MasterClient, calls: OpenCalls) -> Any:
                groups = _description(described)
                fields = change_fields(groups, changes, states)
                caller = ServiceCaller(master, name + SERVICE, calls=calls)
                answer = caller.call(caller.request([{"config": fields}]), TOOL_CALL_S).config
                return {"values": shown_values(values(answer)), "states": _states(answer, groups)}

            return await self._system.calls.run(call)


def shown_group(group: Mapping[str, Any]) -> Mapping[str, Any]:
    """Convert a decoded group for the page: parameters with bounds and constants, and subgroups."""
    return {
        "name": group.get("name", ""),
        "type": group.get("type", ""),
        "parameters": [_shown_parameter(each) for each in group.get("parameters", ())],
        "groups": [shown_group(each) for each in group.get("groups", {}).values()],
    }


def _shown_parameter(described: Mapping[str, Any]) -> Mapping[str, Any]:
    low, high = described["min"], described["max"]
    is_number = described["type"] in ("int", "double")
    has_bounds = is_number and math.isfinite(low) and math.isfinite(high) and high - low < WHOLE
    return {
        "name": described["name"],
        "type": described["type"],
        "description": described["description"],
        "default": _plain(described["default"]),
        "bounds": [low, high] if has_bounds else None,
        "constants": [
            {
                "name": str(each["name"]),
                "value": _plain(each["value"]),
                "text": str(each.get("description", "")),
            }
            for each in constants(described["edit_method"])
        ],
    }


def shown_values(config: Mapping[str, object]) -> Mapping[str, Any]:
    """Return the values of a configuration. NaN and infinity become strings."""
    return {name: _plain(value) for name, value in config.items()}


def _plain(value: object) -> Any:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _states(message: object, description: Mapping[str, object]) -> Mapping[str, bool]:
    tree = decode_config(message, description).get("groups", {})
    return {group["name"]: bool(group["state"]) for group in all_groups(tree)}


def _number(watch: TopicWatch) -> int:
    return watch.newest.number if watch.newest is not None else 0


def _shown(described: TopicWatch, updates: TopicWatch, is_changed: bool) -> Sequence[Mapping[str, Any]]:
    """Return the updates for the page: the groups if the description has changed, and the values."""
    groups, current = _description(described), _message(updates, "dynamic_reconfigure/Config")
    news = {"values": shown_values(values(current)), "states": _states(current, groups)}
    return ({"groups": shown_group(groups)}, news) if is_changed else (news,)


def _message(watch: TopicWatch, type_name: str) -> Any:
    if watch.newest is None:
        raise RequestRefused(f"no message has been received on {watch.topic} yet")
    message = watch.newest.message
    if len(message.body) > MAX_BYTES:
        raise RequestRefused(
            f"messages on {watch.topic} must have at most {MAX_BYTES} bytes, got {len(message.body)}"
        )
    return watch.decode_as(message, load_message_class(type_name))


def _description(watch: TopicWatch) -> Mapping[str, Any]:
    try:
        return decode_description(_message(watch, "dynamic_reconfigure/ConfigDescription"))
    except (KeyError, RecursionError) as error:
        what = f"{watch.topic} must describe parameters with bounds and defaults"
        fault = f"{error} is missing" if isinstance(error, KeyError) else "its groups are nested too deeply"
        raise RequestRefused(f"{what}; {fault}") from None
