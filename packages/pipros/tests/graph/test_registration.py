"""Registrations that fail while the master is not reachable."""

from __future__ import annotations

import asyncio
import logging

import pytest

from pipros.basics.errors import Unreachable
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.node.registration import PublicationEntry, Registrations

API = "http://127.0.0.1:1/"


def test_a_failed_registration_is_repeated_while_the_master_knows_the_node(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = MasterClient(master.uri, "/talker")
    registrations = Registrations(client, "/talker", API, logging.getLogger(__name__))
    registrations.add(PublicationEntry("/registered", "std_msgs/String"))

    with monkeypatch.context() as broken:

        def unreachable(*_: object, **__: object) -> None:
            raise Unreachable("127.0.0.1:11311", "timed out")

        broken.setattr(client, "register_publisher", unreachable)
        late, removed = (PublicationEntry(topic, "std_msgs/String") for topic in ("/late", "/removed"))
        registrations.add(late)
        registrations.add(removed)
        registrations.remove(removed)
    assert published(client) == ["/registered"]

    async def watch() -> None:
        watching = asyncio.create_task(registrations.watch())
        while published(client) == ["/registered"]:
            await asyncio.sleep(0.02)
        watching.cancel()

    asyncio.run(asyncio.wait_for(watch(), 30))
    assert published(client) == ["/late", "/registered"]
    registrations.close()
    assert published(MasterClient(master.uri, "/test")) == []


def published(client: MasterClient) -> list[str]:
    return sorted(topic for topic, _ in client.get_system_state()[0])
