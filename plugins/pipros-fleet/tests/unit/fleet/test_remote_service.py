"""Calls of local nodes to a service of another member."""

import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.node.any_msg import AnyMsg
from pipros.node.service_server import HandlerError
from pipros_fleet.calls import RemoteService
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.zenoh_session import FleetAnswer
from tests.support.constants import Constants
from tests.support.waiting import wait_until


def test_pending_calls_of_a_node_leave_room_for_those_of_others(constants: Constants) -> None:
    constants(FLEET_CALLS=4)
    gate, asked = threading.Event(), list[str]()

    def answer(key: str, *_: object, **__: object) -> list[FleetAnswer]:
        asked.append(key)
        gate.wait(60)
        return [FleetAnswer(key, b"\x01", b"")]

    node = SimpleNamespace(serve=lambda *_: None, is_ending=False)
    parts: Any = node, SimpleNamespace(get=answer)
    service = RemoteService(*parts, "me", "robot1", DirectoryEntry("/slow", "a/B", "0" * 32))

    def call(caller: str) -> object:
        request = AnyMsg(b"")
        request._connection_header = {"callerid": caller}
        return service._call(request)

    with ThreadPoolExecutor() as pool:
        pending = [pool.submit(call, caller) for caller in ("/greedy", "/greedy", "/other")]
        wait_until(lambda: len(asked) == 3)
        with pytest.raises(HandlerError, match="too many calls"):
            call("/greedy")
        gate.set()
        assert [each.result(60) for each in pending]
