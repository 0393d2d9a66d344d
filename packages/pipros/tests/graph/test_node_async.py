"""The asynchronous API of a node: topics and services with `await`."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.service_link import CallTimeout
from tests.support.nodes import MakeNode, wait_until_connected

String: Any = load_message_class("std_msgs/String")
SetBool: Any = load_service_class("std_srvs/SetBool")


def run(coroutine: Coroutine[Any, Any, Any]) -> Any:
    return asyncio.run(asyncio.wait_for(coroutine, 60))


def test_messages_are_iterated_in_order_and_the_iteration_ends_with_the_node(
    make_node: MakeNode, master: Master
) -> None:
    publisher = make_node("talker").advertise("chat", String, queue_size=0)

    async def listen() -> list[str]:
        heard = []
        async with Node("listener", environment=Environment(master_uri=master.uri)) as node:
            subscriber = node.subscribe("chat", String)
            await asyncio.to_thread(wait_until_connected, publisher)
            for number in range(5):
                publisher.publish(String(str(number)))
            async for message in subscriber:
                heard.append(message.data)
                if len(heard) == 5:
                    threading.Thread(target=node.shutdown).start()
        return heard

    assert run(listen()) == ["0", "1", "2", "3", "4"]


def test_unregistering_ends_the_iteration(make_node: MakeNode) -> None:
    node = make_node("listener")

    async def listen() -> int:
        subscriber = node.subscribe("chat", String)
        asyncio.get_running_loop().call_soon(subscriber.unregister)
        return len([message async for message in subscriber])

    assert run(listen()) == 0


def test_a_subscriber_with_a_callback_is_not_an_iterator(make_node: MakeNode) -> None:
    with pytest.raises(TypeError, match=r"\[/chat\] was subscribed to with a callback"):
        aiter(make_node("listener").subscribe("chat", String, print))


def test_a_service_is_served_and_called_by_coroutines(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")

    async def handle(request: Any) -> Any:
        await asyncio.sleep(0)
        return SetBool._response_class(success=request.data, message=threading.current_thread().name)

    async def talk() -> Any:
        server.serve("set", SetBool, handle)
        return await client.call("set", SetBool, SetBool._request_class(data=True), timeout_s=30)

    response = run(talk())
    assert (response.success, response.message) == (True, "MainThread")


def test_an_awaited_call_can_be_limited_and_cancelled(make_node: MakeNode) -> None:
    server, client, gate = make_node("server"), make_node("client"), threading.Event()
    entered = threading.Event()
    server.serve("hang", SetBool, lambda _: (entered.set(), gate.wait(60), SetBool._response_class())[2])
    request = SetBool._request_class()

    async def talk() -> None:
        with pytest.raises(CallTimeout):
            await client.call("hang", SetBool, request, timeout_s=0.05)
        entered.clear()
        task = asyncio.ensure_future(client.call("hang", SetBool, request))
        await asyncio.to_thread(entered.wait, 60)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    run(talk())
    gate.set()
