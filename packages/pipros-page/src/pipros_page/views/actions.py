"""Show actions with their servers and goals, and send and cancel goals interactively."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time
from collections import Counter, deque
from collections.abc import AsyncIterator, Mapping, Sequence
from concurrent.futures import Future
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros_libraries.actions.status import TERMINAL, Status
from pipros_page.bounded_list import bounded_list
from pipros_page.messages.known_topic import LONGEST_NAME
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.calls import message_class_in, withdraw, yaml_in
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.message_from_yaml import message_from_yaml
from pipros_tools.graph.message_tree import message_tree
from pipros_tools.graph.observer import GraphObservation

TOPICS = ("goal", "cancel", "status", "feedback", "result")
CONNECTING_S = 5.0
"""Maximum time (s) to wait for an action's server to connect."""
UPDATE_INTERVAL_S = 0.1
KEPT_GOALS = 16
"""Maximum number of goals of an action whose publishers are kept."""


class ActionViews:
    """The views and actions of the Actions tab.

    If a policy sets a time limit, unregistering a goal's publisher cancels the goal. The publishers of the
    newest goals are therefore kept while a browser shows the action.
    """

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._numbers = itertools.count(1)
        self._shown: Counter[str] = Counter()
        self._kept: dict[str, deque[Future[Any]]] = {}

    async def actions(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the list of actions, with goal topic types and server nodes, after each observation."""
        async for observation in self._system.observations():
            yield {"actions": bounded_list(action_rows(observation)), "error": observation.error}

    async def action(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield an action's goals, newest feedback and newest result whenever any of them changes."""
        name = topic_name(arguments)
        with contextlib.ExitStack() as stack:
            status, feedback, result = (
                stack.enter_context(self._system.topics.watch(f"{name}/{part}")) for part in TOPICS[2:]
            )
            self._shown[name] += 1
            stack.callback(self._hide, name)
            sent = None
            while True:
                state = await self._system.computations.run(_state, status, feedback, result)
                if state != sent:
                    sent = state
                    yield state
                await asyncio.sleep(UPDATE_INTERVAL_S)

    async def send_goal(self, arguments: Mapping[str, object]) -> Any:
        """Send a goal in YAML once the action's server has connected, and return the goal's id."""
        name, value, goal_class = (
            topic_name(arguments),
            await yaml_in(self._system, arguments, "goal"),
            message_class_in(arguments),
        )
        now_ns = time.time_ns()
        goal_id = f"{self._system.node.name}-{next(self._numbers)}-{now_ns / 1e9:.3f}"
        values = {"header": "auto", "goal_id": {"stamp": "now", "id": goal_id}, "goal": value or {}}
        message = await self._system.computations.run(message_from_yaml, goal_class, values, now_ns)
        kept = self._kept.setdefault(name, deque())
        kept.append(await self._publish(f"{name}/goal", goal_class, message))
        if len(kept) > KEPT_GOALS:
            withdraw(self._system, kept.popleft())
        if not self._shown[name]:
            self._withdraw_goals(name)
        return {"id": goal_id}

    async def cancel_goal(self, arguments: Mapping[str, object]) -> Any:
        """Request cancellation of a goal, or of all goals if no id is given."""
        goal_id = arguments.get("id", "")
        if not isinstance(goal_id, str):
            raise RequestRefused(f"id must be a string, got {goal_id!r}")
        message_class = load_message_class("actionlib_msgs/GoalID")
        message = message_from_yaml(message_class, {"id": goal_id}, time.time_ns())
        withdraw(self._system, await self._publish(f"{topic_name(arguments)}/cancel", message_class, message))
        return {}

    def _hide(self, name: str) -> None:
        self._shown[name] -= 1
        if not self._shown[name]:
            del self._shown[name]
            self._withdraw_goals(name)

    def _withdraw_goals(self, name: str) -> None:
        for advertised in self._kept.pop(name, ()):
            withdraw(self._system, advertised)

    async def _publish(self, topic: str, message_class: object, message: object) -> Future[Any]:
        """Publish one message when all known subscribers have connected. Return the publisher's future.

        After `CONNECTING_S`, publish it even if only some have connected, and raise `RequestRefused` if none
        has.
        """
        system = self._system
        advertising = system.questions.start(system.gate.advertise, topic, message_class, queue_size=10)
        try:
            publisher = await asyncio.wrap_future(advertising)
            deadline = time.monotonic() + CONNECTING_S
            wanted = len(system.observation.state.subscribers.get(topic, ())) or 1
            while publisher.connection_count < wanted and time.monotonic() < deadline:
                await asyncio.sleep(0.02)
            if not publisher.connection_count:
                raise RequestRefused(f"no action server subscribed to {topic} within {CONNECTING_S:.0f} s")
            publisher.publish(message)
        except BaseException:
            advertising.add_done_callback(lambda done: withdraw(system, done))
            raise
        return advertising


def action_rows(observation: GraphObservation) -> list[Sequence[str]]:
    """Return each action's name, goal topic type and server nodes, sorted by name."""
    topics = frozenset(observation.state.topics())
    bases = (topic.removesuffix("/goal") for topic in topics if topic.endswith("/goal"))
    return [
        (
            base,
            observation.types.get(f"{base}/goal", ""),
            ", ".join(observation.state.publishers.get(f"{base}/status", ())),
        )
        for base in sorted(bases)
        if base and topics.issuperset(f"{base}/{part}" for part in TOPICS)
    ]


def _state(status: TopicWatch, feedback: TopicWatch, result: TopicWatch) -> Mapping[str, Any]:
    goals = _goals(status)
    return {"goals": goals, "feedback": _newest(feedback, "feedback"), "result": _newest(result, "result")}


def _goals(watch: TopicWatch) -> list[Mapping[str, Any]]:
    """Return the id, status and text of each goal that the server reports, newest first."""
    if watch.newest is None:
        return []
    array = watch.decode_as(watch.newest.message, load_message_class("actionlib_msgs/GoalStatusArray"))
    rows = [_goal(each) for each in array.status_list]
    return bounded_list(reversed(rows))


def _goal(status: Any) -> Mapping[str, Any]:
    known = status.status in Status.__members__.values()
    return {
        "id": status.goal_id.id[:LONGEST_NAME],
        "status": Status(status.status).name.lower() if known else str(status.status),
        "open": known and Status(status.status) not in TERMINAL,
        "text": status.text[:LONGEST_NAME],
    }


def _newest(watch: TopicWatch, part: str) -> Mapping[str, Any] | None:
    """Return the goal and the content of the newest feedback or result."""
    if watch.newest is None:
        return None
    try:
        message: Any = watch.decode(watch.newest.message)
        return {
            "goal": _goal(message.status),
            "message": message_tree(getattr(message, part), for_browser=True),
        }
    except (AttributeError, PiprosError) as error:
        return {"goal": None, "message": str(error)}
