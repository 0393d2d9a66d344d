"""ros_comm#2288, #2021, #1439, #2181: a cached parameter stayed old for minutes, or reading it hung."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros.net.rpc_client import RpcClient
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until


def cached(node: Any, name: str) -> Any:
    """Return the cached value; None when it is not set."""
    try:
        return node.params.get_cached(name)
    except NotFound:
        return None


def test_a_cached_parameter_follows_changes_by_other_nodes(make_node: MakeNode) -> None:
    reader, writer = make_node("reader"), make_node("writer")
    assert cached(reader, "/gains/p") is None
    writer.params.set("/gains/p", 1)
    wait_until(lambda: cached(reader, "/gains/p") == 1)
    assert cached(reader, "/gains") == {"p": 1}
    writer.params.set("/gains", {"p": 2, "d": 3})
    wait_until(lambda: cached(reader, "/gains/p") == 2)
    wait_until(lambda: cached(reader, "/gains") == {"p": 2, "d": 3})
    writer.params.delete("/gains/p")
    wait_until(lambda: cached(reader, "/gains/p") is None)
    wait_until(lambda: cached(reader, "/gains") == {"d": 3})


def test_a_node_sees_its_own_changes_at_once(make_node: MakeNode) -> None:
    node = make_node("node")
    node.params.set("/gains/p", 1)
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (1, {"p": 1})
    node.params.set("/gains/p", 2)
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (2, {"p": 2})
    node.params.set("/gains", {"p": 3, "d": 4})
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (3, {"p": 3, "d": 4})
    node.params.delete("/gains/p")
    assert (cached(node, "/gains/p"), cached(node, "/gains")) == (None, {"d": 4})


def test_an_old_notice_does_not_undo_a_later_change_by_the_node(make_node: MakeNode) -> None:
    node = make_node("node")
    node.params.set("/speed", 1)
    assert cached(node, "/speed") == 1
    node.params.set("/speed", 3)
    with RpcClient(node.uri) as master:
        master.call("paramUpdate", "/master", "/speed/", 2)  # was in transit for longer
    assert cached(node, "/speed") == 3


def test_a_change_during_the_first_fetch_is_not_missed(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, writer = make_node("reader"), make_node("writer")
    writer.params.set("/speed", 1)
    subscribe = reader.master.subscribe_param
    update, notices = reader.params.update, []

    def note_update(key: str, value: Any) -> bool:
        is_cached = bool(update(key, value))
        notices.append(key)
        return is_cached

    monkeypatch.setattr(reader.params, "update", note_update)

    def subscribe_slowly(api: str, key: str) -> Any:
        value = subscribe(api, key)
        writer.params.set("/speed", 2)
        wait_until(lambda: notices)  # the notification has overtaken the response
        return value

    monkeypatch.setattr(
        type(reader.master), "subscribe_param", lambda _, api, key: subscribe_slowly(api, key)
    )
    assert cached(reader, "/speed") == 2


def test_many_threads_may_read_while_others_write(make_node: MakeNode) -> None:
    node, writer = make_node("node"), make_node("writer")

    def read() -> None:
        for number in range(100):
            cached(node, f"/busy/{number % 7}")

    def write(by: Any) -> None:
        for number in range(50):
            by.params.set(f"/busy/{number % 7}", number)

    threads = [threading.Thread(target=read, daemon=True) for _ in range(4)]
    threads += [threading.Thread(target=write, args=(by,), daemon=True) for by in (node, writer)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    for number in range(7):
        truth = writer.params.get(f"/busy/{number}")
        wait_until(lambda key=f"/busy/{number}", value=truth: cached(node, key) == value)
