"""Call services and publish messages interactively: `rqt_service_caller` and `rqt_publisher`."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Mapping
from concurrent.futures import Future
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node.open_calls import OpenCalls
from pipros.node.service_link import ErrorReply
from pipros.safe.yaml import load
from pipros_libraries.nodes.velocities import VELOCITIES
from pipros_page.bounded_list import bounded_list
from pipros_page.messages.pattern import MessagePattern
from pipros_page.service_calls import CALL_BY_HAND_S
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.act_gate import GatedPublisher
from pipros_server.browser_share import browser_or_none
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.message_from_yaml import message_from_yaml
from pipros_tools.graph.message_tree import message_tree
from pipros_tools.graph.service_call import ServiceCaller
from pipros_tools.graph.services import argument_names, service_class_of
from pipros_workspace.type_catalogue import SERVICES

FASTEST_HZ = 1000.0
TELL_INTERVAL_S = 0.5
SILENCE_S = 1.0
"""Time after which a browser that answers no ping no longer publishes velocities."""
QUICK_CHARACTERS = 10_000
"""Maximum length of a published message without expressions that is made in the event loop."""


class CallViews:
    """The views of the Services and Publish tabs."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def services(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the list of all services and their nodes after each observation of the system."""
        async for observation in self._system.observations():
            services = observation.state.services
            rows = ([name, *nodes[:1]] for name, nodes in sorted(services.items()))
            yield {"services": bounded_list(rows)}

    async def service(self, arguments: Mapping[str, object]) -> Any:
        """Return a service's type, definition and argument names, and a request with default values."""
        name = topic_name(arguments)
        service_class = await self._system.calls.run(
            lambda master, calls: service_class_of(master, name, calls)
        )
        return {
            "type": service_class._type,
            "arguments": argument_names(service_class),
            "definition": await self._system.computations.run(_definition_of, service_class._type),
            "request": message_tree(service_class._request_class()),
        }

    async def call_service(self, arguments: Mapping[str, object]) -> Any:
        """Call a service with a request in YAML. Return the response and the duration (s)."""
        name, value = topic_name(arguments), await yaml_in(self._system, arguments, "request")

        def call(master: MasterClient, calls: OpenCalls) -> Any:
            caller = ServiceCaller(master, name, calls=calls)
            begin_s = time.monotonic()
            try:
                request = caller.request([] if value is None else [value])
                with self._system.gate.calling(name, request, *caller.type_and_md5sum):
                    response = caller.call(request, CALL_BY_HAND_S)
            except ErrorReply as error:
                raise RequestRefused(f"the service replied with an error: {error.text}") from None
            return {
                "response": message_tree(response, for_browser=True),
                "seconds": round(time.monotonic() - begin_s, 4),
            }

        return await self._system.calls.run(call)

    async def message(self, arguments: Mapping[str, object]) -> Any:
        """Return a message of the requested type with default values."""
        return message_tree(message_class_in(arguments)())

    async def publishing(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Publish a message at a rate (Hz) while the view is open. Yield the number of published messages.

        With a rate of 0, one latched message is published. Velocities stop when the browser falls silent.

        Strings that begin with "=" are evaluated as expressions of `i`, the message's number, counted from 0,
        and `t`, the seconds since the first message.
        """
        topic, value = topic_name(arguments), await yaml_in(self._system, arguments, "message")
        rate = arguments.get("rate", 1.0)
        if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not 0.0 <= rate <= FASTEST_HZ:
            raise RequestRefused(f"rate must be from 0 to {FASTEST_HZ:.0f} Hz, got {rate!r}")
        message_class, compute = message_class_in(arguments), self._system.computations.run
        pattern = await compute(MessagePattern, value)
        is_quick = not pattern.has_expressions and len(str(arguments.get("message", ""))) <= QUICK_CHARACTERS

        def made(number: int, seconds: float) -> Any:
            return message_from_yaml(message_class, pattern.value(number, seconds), time.time_ns())

        async def message(number: int, seconds: float) -> Any:
            return made(number, seconds) if is_quick else await compute(made, number, seconds)

        await message(0, 0.0)  # raise errors before advertising the topic
        advertising = self._system.questions.start(
            self._system.gate.advertise, topic, message_class, queue_size=10, latch=not rate
        )
        silence = None
        if message_class._type in VELOCITIES and (browser := browser_or_none()):
            silence = asyncio.ensure_future(browser.until_silent(SILENCE_S))
        try:
            publisher = await asyncio.wrap_future(advertising)
            count = 0
            begin_s = told_s = time.monotonic()
            while True:
                publisher.publish(await message(count, count / rate if rate else 0.0))
                count += 1
                now_s = time.monotonic()
                if not rate or now_s - told_s >= TELL_INTERVAL_S or count == 1:
                    told_s = now_s
                    yield {"count": count}
                rest_s = max(0.0, begin_s + count / rate - time.monotonic()) if rate else None
                if silence is None:
                    await (asyncio.Event().wait() if rest_s is None else asyncio.sleep(rest_s))
                elif (await asyncio.wait([silence], timeout=rest_s))[0]:
                    raise RequestRefused(f"the browser was silent for {SILENCE_S:g} s: {topic} was stopped")
        finally:  # The master may not have responded yet: do not wait, but unregister once it has.
            if silence is not None:
                silence.cancel()
            advertising.add_done_callback(lambda done: withdraw(self._system, done))


def withdraw(system: WatchedSystem, advertised: Future[GatedPublisher]) -> None:
    """Unregister the publisher that an `advertise` call returned, if it succeeded. Does not block."""
    if not advertised.cancelled() and advertised.exception() is None:
        system.questions.start(advertised.result().unregister)


def _definition_of(type_name: str) -> str:
    """Return the text of a type's `.srv` file, or an empty string if only generated code is installed."""
    try:
        return SERVICES.text(type_name, is_raw=True)
    except PiprosError:
        return ""


def message_class_in(arguments: Mapping[str, object]) -> Any:
    """Load the message class given as the argument `type` of a request."""
    name = arguments.get("type")
    if not isinstance(name, str) or name.count("/") != 1:
        raise RequestRefused(f"type must be a message type such as std_msgs/String, got {name!r}")
    try:
        return load_message_class(name)
    except PiprosError as error:
        raise RequestRefused(f"cannot load type {name}: {error}") from None


async def yaml_in(system: WatchedSystem, arguments: Mapping[str, object], key: str) -> Any:
    """Parse the YAML string in a request's argument `key`, in a thread, because it may be large."""
    text = arguments.get(key, "")
    if not isinstance(text, str):
        raise RequestRefused(f"{key} must be a YAML string, got {type(text).__name__}")
    return await system.computations.run(load, text, key, angles=False)
