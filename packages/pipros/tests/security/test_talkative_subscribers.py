"""Subscribers that send data on a topic link."""

from __future__ import annotations

import contextlib
from typing import Any

from pipros.msg import load_message_class
from tests.support.constants import Constants
from tests.support.nodes import MakeNode, listening_log, wait_until_connected
from tests.support.subscribers import raw_subscriber
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


def test_a_subscriber_that_keeps_sending_is_disconnected(make_node: MakeNode) -> None:
    log, lines = listening_log()
    talker = make_node("talker", log=log)
    publisher = talker.advertise("chat", String)
    with raw_subscriber(talker, "/chat", "/flood\x1b[31m") as sock:
        wait_until_connected(publisher)
        with contextlib.suppress(OSError):  # it is closed meanwhile
            while publisher.connection_count:
                sock.sendall(bytes(1024))
        wait_until(lambda: publisher.connection_count == 0)
    found = wait_until(lambda: [line for line in lines if "4096 bytes after its header" in line])
    assert r"subscriber [/flood\x1b[31m] of [/chat]" in found[0]


def test_a_subscriber_that_sends_a_few_bytes_keeps_its_link(
    make_node: MakeNode, constants: Constants
) -> None:
    constants(SUBSCRIBER_BYTES=100)
    talker = make_node("talker")
    publisher = talker.advertise("chat", String)
    with raw_subscriber(talker, "/chat") as sock:
        wait_until_connected(publisher)
        sock.sendall(bytes(100))
        publisher.publish(String("still here"))
        received = b""
        while not received.endswith(b"still here"):
            received += sock.recv(1024)
        sock.sendall(bytes(1))
        wait_until(lambda: publisher.connection_count == 0)
