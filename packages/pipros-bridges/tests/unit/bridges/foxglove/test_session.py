"""One Foxglove client on a bridge without ROS and without sockets."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Collection, Mapping
from typing import Any, cast

import pytest

from pipros.basics.errors import LimitExceeded, PiprosError
from pipros.basics.limits import Limits
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.packages.assets import AssetRefused
from pipros_bridges.call_turns import CallTurns
from pipros_bridges.client import BridgeClient
from pipros_bridges.foxglove.catalog import TopicCatalog
from pipros_bridges.foxglove.graph_changes import GraphUpdates
from pipros_bridges.foxglove.handler import FoxgloveHandler, Rules
from pipros_bridges.foxglove.parameter_watch import DELETED
from pipros_bridges.foxglove.sent_assets import Asset
from pipros_bridges.foxglove.session import CHANNEL_SUBSCRIPTIONS, TURN, FoxgloveSession
from pipros_bridges.outbox import ClientOutbox, WebSocketFrame
from pipros_bridges.shared_topics import TopicMessage
from pipros_bridges.shares import ServerShares
from pipros_server.daemon_pool import DaemonPool
from pipros_tools.graph.definitions import Definition
from pipros_tools.graph.system_state import SystemState
from tests.support.constants import Constants

MD5SUM = "a" * 32
TEXT = Definition("std_msgs/String", MD5SUM, "string data")


class FakeTaken:
    is_closed = False

    def close(self) -> None:
        self.is_closed = True


class FakeTopics:
    """Topics that a test publishes."""

    def __init__(self) -> None:
        self.taken: list[tuple[str, str | None, Callable[[TopicMessage], object], FakeTaken]] = []
        self.error: PiprosError | None = None

    def wait_for_turn(self, user: Any) -> None:
        pass

    def take(
        self, topic: str, kind: str | None, on_message: Any, on_error: Any = None, user: Any = None
    ) -> FakeTaken:
        if self.error is not None:
            raise self.error
        taken = FakeTaken()
        self.taken.append((topic, kind, on_message, taken))
        return taken

    def publish(self, body: bytes, md5sum: str = MD5SUM) -> None:
        for topic, _, on_message, taken in self.taken:
            if not taken.is_closed:
                on_message(TopicMessage(topic, body, {"md5sum": md5sum}, 5))


class FakeBridge:
    """The state that sessions share, without ROS."""

    def __init__(self, *, has_control: bool = True, limits: Limits | None = None) -> None:
        self.node = Node("bridge", limits=limits)
        self.topics: Any = FakeTopics()
        self.catalog = TopicCatalog()
        self.catalog.update_channels({"/chatter": TEXT})
        self.state = SystemState({"/chatter": ["/talker"]}, {}, {})
        self.graph_updates = GraphUpdates()
        self.has_control = has_control
        self.threads = DaemonPool("test", 2)
        self.call_turns = CallTurns("test calls", 2)
        self.corrected: list[str] = []
        self.left: list[FoxgloveSession] = []
        self.watched = 0

    def offers(self, capability: str) -> bool:
        return self.has_control or capability not in ("clientPublish", "services")

    def allows_publishing(self, name: str) -> bool:
        return name != "/hidden"

    def allows_parameter(self, name: str) -> bool:
        return name != "/hidden"

    def leave(self, session: FoxgloveSession) -> None:
        self.left.append(session)

    def correct(self, topic: str, header: Mapping[str, str]) -> None:
        self.corrected.append(topic)

    def watch_parameters(self) -> None:
        self.watched += 1

    def parameters(self, names: Collection[str] = ()) -> Mapping[str, Any]:
        return {"/a": 1, "/robot/b": 2.0}

    def read_asset(self, uri: str) -> Asset:
        if uri != "package://p/a.stl":
            raise AssetRefused("not there")
        return Asset(b"solid")


class FakeClient:
    """The connection of the client, which records what is sent."""

    def __init__(self, limits: Limits) -> None:
        self.outbox = ClientOutbox(1_000_000, lambda: None)
        self.shares = ServerShares(limits).client(is_reader=False)
        self.ended: list[str] = []

    def end(self, reason: str) -> None:
        self.ended.append(reason)

    def send(self, *frames: WebSocketFrame) -> None:
        self.outbox.answer(*frames)

    async def send_large(self, make: Callable[[], Awaitable[WebSocketFrame]]) -> None:
        self.outbox.answer(await make())

    def received(self) -> list[Any]:
        """Everything that was sent since the last call: JSON values, or bytes."""
        found: list[Any] = []
        while (frames := self.outbox.pop()) is not None:
            for frame in frames:
                data = b"".join(frame.parts)
                found.append(json.loads(data) if frame.is_text else data)
        return found


class Conversation:
    """A session and its client."""

    def __init__(self, **options: Any) -> None:
        self.bridge = FakeBridge(**options)
        self.client = FakeClient(self.bridge.node.limits)
        self.session = FoxgloveSession(self.client, self.bridge)

    async def say(self, op: str | bytes, **fields: Any) -> list[Any]:
        """Send a message, and return the answers."""
        await self.session.receive(op if isinstance(op, bytes) else json.dumps({"op": op, **fields}))
        return self.client.received()

    async def answer(self) -> Any:
        """The next answer to a request that takes time."""
        while not (found := self.client.received()):
            await asyncio.sleep(0)
        return found[0]


def run(body: Callable[[], Awaitable[None]]) -> None:
    async def bounded() -> None:
        await asyncio.wait_for(body(), 30)

    asyncio.run(bounded())


def text_of(answers: list[Any]) -> str:
    [status] = answers
    assert status["op"] == "status"
    return str(status["message"])


@pytest.mark.parametrize("request_of", [
    lambda count: {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 9}] * count},
    lambda count: {"op": "unsubscribe", "subscriptionIds": [1] * count},
    lambda count: {"op": "unadvertise", "channelIds": [1] * count},
], ids=["subscribe", "unsubscribe", "unadvertise"])  # fmt: skip
def test_a_long_request_lets_other_clients_have_their_turn(request_of: Callable[[int], Any]) -> None:
    async def body() -> None:
        talk, turns = Conversation(), list[int]()

        async def others() -> None:
            while True:
                turns.append(len(talk.client.received()))
                await asyncio.sleep(0)

        task = asyncio.create_task(others())
        await talk.session.receive(json.dumps(request_of(20 * TURN)))
        assert sum(turns) + len(talk.client.received()) == 20 * TURN
        assert max(turns) <= TURN
        task.cancel()

    run(body)


def test_parameters_can_be_subscribed_up_to_the_limit(constants: Constants) -> None:
    async def body() -> None:
        constants(BRIDGE_SUBSCRIPTIONS=2)
        talk = Conversation(limits=Limits())
        await talk.say("subscribeParameterUpdates", parameterNames=["/a", "/b"])
        assert await talk.say("subscribeParameterUpdates", parameterNames=["/a"]) == []
        more = await talk.say("subscribeParameterUpdates", parameterNames=["/c"])
        assert "the limit is 2" in text_of(more)

    run(body)


def test_a_client_can_subscribe_to_a_channel_a_few_times_only() -> None:
    async def body() -> None:
        talk = Conversation()
        rows = [{"id": number, "channelId": 1} for number in range(CHANNEL_SUBSCRIPTIONS + 1)]
        assert "channel 1 already has 8 subscriptions" in text_of(
            await talk.say("subscribe", subscriptions=rows)
        )
        assert len(talk.session.takes()) == CHANNEL_SUBSCRIPTIONS
        await talk.say("unsubscribe", subscriptionIds=[0])
        assert await talk.say("subscribe", subscriptions=rows[-1:]) == []

    run(body)


def test_wrong_subscriptions_are_reported(constants: Constants) -> None:
    async def body() -> None:
        constants(BRIDGE_SUBSCRIPTIONS=2)
        talk = Conversation(limits=Limits())
        twice = [{"id": 1, "channelId": 1}] * 2
        assert "already exists" in text_of(await talk.say("subscribe", subscriptions=twice))
        assert "channel 9 does not exist" in text_of(
            await talk.say("subscribe", subscriptions=[{"id": 2, "channelId": 9}])
        )
        more = [{"id": number, "channelId": 1} for number in (2, 3)]
        assert "the limit is 2" in text_of(await talk.say("subscribe", subscriptions=more))
        talk.bridge.topics.error = LimitExceeded("too many topics")
        await talk.say("unsubscribe", subscriptionIds=[2])
        assert "too many topics" in text_of(await talk.say("subscribe", subscriptions=more[:1]))
        assert talk.session.takes() == {1: "/chatter"}

    run(body)


def test_only_subscribed_parameters_are_shown() -> None:
    async def body() -> None:
        talk = Conversation()
        changes = {"/a": 3, "/b": DELETED, "/c": 4}
        talk.session.show_parameters(changes)
        assert talk.client.received() == []
        await talk.say("subscribeParameterUpdates", parameterNames=["/a", "b"])
        assert talk.session.takes_parameters
        talk.session.show_parameters(changes)
        [update] = talk.client.received()
        assert update["parameters"] == [{"name": "/a", "value": 3}, {"name": "/b"}]
        await talk.say("subscribeParameterUpdates", parameterNames=[])
        talk.session.show_parameters(changes)
        assert len(talk.client.received()[0]["parameters"]) == 3
        await talk.say("unsubscribeParameterUpdates", parameterNames=[])
        await talk.say("unsubscribeParameterUpdates", parameterNames=["/a", "/b"])
        assert talk.bridge.watched == 4
        assert not talk.session.takes_parameters

    run(body)


def test_the_graph_is_shown_while_it_is_wanted() -> None:
    async def body() -> None:
        talk = Conversation()
        talk.session.show_graph(talk.bridge.state)
        assert talk.client.received() == []
        [first] = await talk.say("subscribeConnectionGraph")
        assert first["publishedTopics"] == [{"name": "/chatter", "publisherIds": ["/talker"]}]
        talk.session.show_graph(talk.bridge.state)
        assert talk.client.received() == []
        talk.session.show_graph(SystemState({}, {}, {}))
        assert talk.client.received()[0]["removedTopics"] == ["/chatter"]
        await talk.say("unsubscribeConnectionGraph")
        talk.session.show_graph(talk.bridge.state)
        assert talk.client.received() == []

    run(body)


def test_all_clients_are_sent_the_same_copy_of_a_large_graph() -> None:
    async def body() -> None:
        first = Conversation()
        others = [Conversation() for _ in range(3)]
        sent = []
        for talk in [first, first, *others]:
            talk.session = FoxgloveSession(talk.client, first.bridge)
            await talk.session.receive('{"op": "subscribeConnectionGraph"}')
            sent += talk.client.outbox.pop() or []
        assert (len(sent), len({id(frame) for frame in sent})) == (5, 1)

    run(body)


def test_all_clients_are_sent_the_same_copy_of_the_list_of_channels() -> None:
    handler = FoxgloveHandler(Node("bridge"), cast(BackgroundLoop, None), Rules())
    handler.catalog.update_channels({"/chatter": TEXT})
    clients = [FakeClient(handler.node.limits) for _ in range(2)]
    for client in clients:
        handler.open(cast(BridgeClient, client))
    first, second = (list(client.outbox.pop() or ()) for client in clients)
    handler.close()
    assert len(first) == 3
    assert first[1] is second[1]
    assert first[2] is second[2]


def test_everything_ends_with_the_client() -> None:
    async def body() -> None:
        talk = Conversation()
        await talk.say("subscribe", subscriptions=[{"id": 7, "channelId": 1}])
        talk.session.close()
        assert talk.bridge.left == [talk.session]
        assert talk.bridge.topics.taken[0][3].is_closed
        assert talk.session.takes() == {}

    run(body)
