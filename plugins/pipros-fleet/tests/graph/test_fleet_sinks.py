"""Topics that a fleet's agent publishes on the local master."""

from __future__ import annotations

import logging
import threading
from io import BytesIO
from itertools import count
from typing import Any

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_fleet.directory import DirectoryEntry
from pipros_fleet.messages import MessageAttachment, pack
from pipros_fleet.sinks import Sink
from tests.support.waiting import wait_until


def test_late_subscribers_get_the_last_message_of_many_latching_publishers(master: Master) -> None:
    text: Any = load_message_class("std_msgs/String")
    environment = Environment(master_uri=master.uri)
    with Node("agent", environment=environment) as agent, Node("late", environment=environment) as late:
        entry = DirectoryEntry("/status", text._type, text._md5sum)
        sink = Sink(agent, entry, "robot1", text._full_text, logging.getLogger(__name__), lambda: None)
        sequence = count(1)

        def send(publisher: int, data: str) -> None:
            attachment = MessageAttachment(
                publisher, "00" * 8, next(sequence), 0, text._md5sum, is_latched=True
            )
            body = BytesIO()
            text(data).serialize(body)
            sink.take("robot1", body.getvalue(), pack(attachment))

        for publisher in range(100):
            send(publisher, f"first of {publisher}")
        send(7, "second of 7")
        send(99, "second of 99")

        lock, received = threading.Lock(), set[str]()

        def receive(message: Any) -> None:
            with lock:
                received.add(message.data)

        late.subscribe("/status", text, receive)
        wait_until(lambda: len(received) >= 100, what="the latched messages")
        assert received == {f"first of {each}" for each in range(100) if each not in (7, 99)} | {
            "second of 7",
            "second of 99",
        }
        sink.close()
