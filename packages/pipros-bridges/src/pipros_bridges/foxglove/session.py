"""Handle the requests of one Foxglove client, and forward the topics to which it subscribes.

Work that may block runs in the bridge's threads.
"""

from __future__ import annotations

import asyncio
import functools
import time
from collections import Counter
from collections.abc import (
    AsyncIterator,
    Awaitable,
    Callable,
    Coroutine,
    Hashable,
    Iterable,
    Mapping,
    Sequence,
)
from typing import Any, Final, TypeVar

from pipros.basics.errors import LimitExceeded, PiprosError
from pipros.basics.printable import printable
from pipros.node.open_calls import OpenCalls
from pipros_bridges.client import BridgeClient
from pipros_bridges.foxglove import frames
from pipros_bridges.foxglove.bridge_state import READ_ONLY, FoxgloveBridge, check_limit
from pipros_bridges.foxglove.catalog import Channel
from pipros_bridges.foxglove.client_parameters import ClientParameters
from pipros_bridges.foxglove.frames import StatusLevel
from pipros_bridges.foxglove.graph_changes import EMPTY
from pipros_bridges.foxglove.parameter_watch import Changes
from pipros_bridges.foxglove.publishing import ClientPublication, call_service
from pipros_bridges.foxglove.requests import (
    CAPABILITY_OF,
    AdvertiseRequest,
    CallRequest,
    ClientChannel,
    ClientRequest,
    FetchAsset,
    GetParameters,
    PublishRequest,
    SetParameters,
    Subscribe,
    SubscribeGraph,
    SubscribeParameters,
    UnadvertiseRequest,
    Unsubscribe,
    UnsubscribeParameters,
    read_request,
)
from pipros_bridges.outbox import WebSocketFrame
from pipros_bridges.shared_topics import Taken, TopicMessage, legal_topic
from pipros_bridges.shares import ExceedsShare
from pipros_tools.graph.system_state import SystemState

# A request without a case would be ignored.
# mypy: enable-error-code="exhaustive-match"

_Item = TypeVar("_Item")

CALL_S: Final = 60.0
"""Timeout of a service call."""
OPEN_REQUESTS: Final = 100
"""Maximum number of pending service calls and asset requests of one client."""
OPEN_ASSETS: Final = 16
"""Maximum number of pending asset requests of one client, which are answered one at a time."""
TURN: Final = 100
"""Number of subscriptions in one request that are handled before other clients have their turn."""
CHANNEL_SUBSCRIPTIONS: Final = 8
"""Maximum number of one client's subscriptions to a channel. Each of them sends the same message again."""
SUBSCRIPTION_BYTES: Final = 1_000
"""Approximate memory for a subscription or a publication, besides the names."""
TIME_KEY: Final = "time"


class FoxgloveSession:
    """The session of one client. For use in the event loop."""

    def __init__(self, client: BridgeClient, bridge: FoxgloveBridge) -> None:
        self._client = client
        self._bridge = bridge
        self._taken: dict[int, tuple[Channel, Taken]] = {}
        self._per_channel = Counter[int]()
        self._publications: dict[int, ClientPublication] = {}
        self._parameters = ClientParameters(client, bridge, self._run, self._report)
        # the graph last sent to the client; None if the client is not subscribed to it
        self._graph: SystemState | None = None
        self._calls = OpenCalls()
        self._tasks: set[asyncio.Task[None]] = set()
        self._call_turns = bridge.call_turns.user()
        self._open_assets = 0
        self._worked_s = 0.0
        client.outbox.open(TIME_KEY, 1)

    async def receive(self, data: str | bytes) -> None:
        """Handle a message. Only service calls and asset requests continue after this returns."""
        try:
            await self._handle(read_request(data, lambda error: self._report(str(error))))
        except ExceedsShare as error:
            self._client.end(str(error))
        except (PiprosError, ValueError, TypeError, OverflowError, OSError) as error:
            self._report(str(error))

    @property
    def worked_s(self) -> float:
        """Processor time (s) that threads have spent on the client's requests, besides calls of services."""
        return self._worked_s

    def takes(self) -> Mapping[Hashable, str]:
        """Return the topics to which the client subscribes, keyed by subscription id."""
        return {number: channel.topic for number, (channel, _) in self._taken.items()}

    def sends(self) -> Sequence[str]:
        """Return the topics that the client publishes."""
        return [publication.channel.topic for publication in self._publications.values()]

    def close(self) -> None:
        """End the client's subscriptions and publications, and cancel its calls and tasks."""
        self._bridge.leave(self)
        self._calls.interrupt()
        self._call_turns.close()
        for task in self._tasks:
            task.cancel()
        for _, taken in self._taken.values():
            taken.close()
        for publication in self._publications.values():
            self._bridge.threads.start(publication.close)
        self._taken.clear()
        self._publications.clear()

    @property
    def is_unused(self) -> bool:
        """Whether the client has no subscriptions, publications or pending requests."""
        is_subscribed = self._taken or self.takes_parameters or self._graph is not None
        return not (is_subscribed or self._publications or self._tasks)

    @property
    def takes_parameters(self) -> bool:
        """Whether the client subscribes to parameters."""
        return self._parameters.is_subscribed

    # -- reports from the bridge ------------------------------------------------------

    def remove_channels(self, ids: Sequence[int]) -> None:
        """End the subscriptions to channels that are no longer offered."""
        gone = [number for number, (channel, _) in self._taken.items() if channel.id in ids]
        for number in gone:
            self._unsubscribe(number)

    def show_graph(self, state: SystemState) -> None:
        """Send the graph's changes if the client subscribes to the graph."""
        if self._graph is not None:
            update = self._bridge.graph_updates.find(self._graph, state)
            self._graph = state
            if update is not None:
                self._client.send(update)

    def show_parameters(self, changes: Changes) -> None:
        """Send the changed parameters to which the client subscribes."""
        self._parameters.show(changes)

    # -- requests ----------------------------------------------------------------------

    async def _handle(self, request: ClientRequest) -> None:
        capability = CAPABILITY_OF[type(request)]
        if capability is not None and not isinstance(request, CallRequest):  # a call's response reports it
            self._check_offered(capability)
        match request:
            case PublishRequest():
                await self._publish(request)
            case Subscribe():
                async for number, channel in _in_turns(request.pairs):
                    self._subscribe(number, channel)
                await self._run(functools.partial(self._bridge.topics.wait_for_turn, self))
            case Unsubscribe():
                async for number in _in_turns(request.ids):
                    self._unsubscribe(number)
            case AdvertiseRequest():
                for each in request.channels:
                    try:
                        await self._advertise(each)
                    except (ExceedsShare, LimitExceeded):
                        raise
                    except (PiprosError, ValueError) as error:
                        self._report(str(error))
            case UnadvertiseRequest():
                async for number in _in_turns(request.ids):
                    await self._unadvertise(number)
            case CallRequest():
                self._begin(self._call(request))
            case GetParameters():
                await self._parameters.send(request.names, request.id)
            case SetParameters():
                await self._parameters.set(request)
            case SubscribeParameters():
                self._parameters.subscribe(request.names)
            case UnsubscribeParameters():
                self._parameters.unsubscribe(request.names)
            case SubscribeGraph():
                self._graph = EMPTY if request.is_wanted else None
                self.show_graph(self._bridge.state)
            case FetchAsset():
                self._begin(self._fetch_asset(request))

    def _subscribe(self, number: int, channel_id: int) -> None:
        channel = self._bridge.catalog.channels.get(channel_id)
        if channel is None:
            self._report(f"channel {channel_id} does not exist", StatusLevel.WARNING)
            return
        if number in self._taken:
            self._report(f"subscription {number} already exists", StatusLevel.WARNING)
            return
        check_limit(len(self._taken))
        if self._per_channel[channel_id] >= CHANNEL_SUBSCRIPTIONS:
            raise LimitExceeded(
                f"channel {channel_id} already has {CHANNEL_SUBSCRIPTIONS} subscriptions of this client, "
                "which is the limit; use one of them"
            )
        outbox, md5sum = self._client.outbox, channel.definition.md5sum

        def deliver(message: TopicMessage) -> None:
            if message.header.get("md5sum") == md5sum:
                outbox.put(number, frames.message_data(number, message.received_ns, message.body))
            else:
                self._bridge.correct(message.topic, message.header)

        outbox.open(number)
        try:
            with self._client.shares.keeping(SUBSCRIPTION_BYTES):
                taken = self._bridge.topics.take(
                    channel.topic,
                    channel.definition.type,
                    deliver,
                    lambda error: self._report(str(error)),
                    self,
                )
        except PiprosError:
            outbox.forget(number)
            raise
        self._taken[number] = channel, taken
        self._per_channel[channel_id] += 1

    def _unsubscribe(self, number: int) -> None:
        found = self._taken.pop(number, None)
        if found is None:
            self._report(f"subscription {number} does not exist", StatusLevel.WARNING)
            return
        found[1].close()
        self._per_channel[found[0].id] -= 1
        if not self._per_channel[found[0].id]:
            del self._per_channel[found[0].id]
        self._client.outbox.forget(number)
        self._client.shares.release(SUBSCRIPTION_BYTES)

    async def _advertise(self, channel: ClientChannel) -> None:
        topic = legal_topic(self._bridge.node, channel.topic)
        if not self._bridge.allows_publishing(topic):
            raise PiprosError(f"the whitelist does not allow topic [{printable(topic)}]")
        if channel.id in self._publications:
            raise PiprosError(f"channel {channel.id} is already advertised")
        check_limit(len(self._publications))
        with self._client.shares.keeping(_size_of(channel)):
            self._publications[channel.id] = await self._run(
                functools.partial(ClientPublication, self._bridge.node, self._bridge.gate, channel)
            )

    async def _unadvertise(self, number: int) -> None:
        publication = self._publications.pop(number, None)
        if publication is None:
            self._report(f"channel {number} is not advertised", StatusLevel.WARNING)
        else:
            self._client.shares.release(_size_of(publication.channel))
            await self._run(publication.close)

    async def _publish(self, request: PublishRequest) -> None:
        publication = self._publications.get(request.channel)
        if publication is None:
            raise PiprosError(f"channel {request.channel} is not advertised")
        await self._run(functools.partial(publication.publish, request.body))

    async def _call(self, request: CallRequest) -> None:
        service = self._bridge.catalog.services.get(request.service)
        try:
            self._check_offered("services")
            if service is None:
                raise PiprosError(f"service {request.service} does not exist")
            body = await self._call_turns.wait_for(
                call_service,
                self._bridge.node,
                self._bridge.gate,
                service,
                request.encoding,
                request.body,
                self._calls,
                CALL_S,
            )
        except (PiprosError, ValueError) as error:
            self._client.send(frames.service_failure(request.service, request.call, str(error)))
            return
        answer = frames.service_response(request.service, request.call, request.encoding, body)

        async def make() -> WebSocketFrame:
            return answer

        await self._client.send_large(make)

    async def _fetch_asset(self, request: FetchAsset) -> None:
        """Send an asset. Assets are read one at a time, after all earlier responses have been sent."""
        if self._open_assets >= OPEN_ASSETS:
            text = f"{OPEN_ASSETS} asset requests are pending; wait until one ends"
            self._client.send(frames.asset_failure(request.request, text))
            return

        async def make() -> WebSocketFrame:
            try:
                asset = await self._run(functools.partial(self._bridge.read_asset, request.uri))
            except PiprosError as error:
                return frames.asset_failure(request.request, str(error))
            return frames.asset(request.request, asset)

        self._open_assets += 1
        try:
            await self._client.send_large(make)
        finally:
            self._open_assets -= 1

    # -- shared by all requests ------------------------------------------------------------------

    def _run(self, function: Callable[[], Any]) -> Awaitable[Any]:
        def work() -> Any:
            began_s = time.thread_time()
            try:
                return function()
            finally:
                self._worked_s += time.thread_time() - began_s

        return self._bridge.threads.run(work)

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Run a request in a task, so that the client's next requests are not delayed."""
        if len(self._tasks) >= OPEN_REQUESTS:
            work.close()
            raise LimitExceeded(
                f"{OPEN_REQUESTS} service calls and asset requests are pending; wait until one ends"
            )
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _check_offered(self, capability: str) -> None:
        if not self._bridge.offers(capability):
            if not self._bridge.has_control:
                raise PiprosError(READ_ONLY)
            raise PiprosError(f"this server does not offer the capability {capability}")

    def _report(self, text: str, level: StatusLevel = StatusLevel.ERROR) -> None:
        """Send a status message. Thread-safe."""
        self._client.send(frames.status(level, text))


async def _in_turns(items: Iterable[_Item]) -> AsyncIterator[_Item]:
    """Yield the parts of a request. Let the event loop serve other clients after every `TURN` of them."""
    for number, item in enumerate(items, 1):
        yield item
        if number % TURN == 0:
            await asyncio.sleep(0)


def _size_of(channel: ClientChannel) -> int:
    """Return the approximate memory for a publication."""
    names = len(channel.topic) + len(channel.type)
    return SUBSCRIPTION_BYTES + 4 * names + 2 * len(channel.schema)
