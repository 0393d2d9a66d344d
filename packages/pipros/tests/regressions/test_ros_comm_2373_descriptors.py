"""ros_comm#2373, #544, #495: descriptors, threads and buffers of unregistered topics were never freed."""

from __future__ import annotations

import gc
import os
import sys
import threading
import weakref
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.net.workers import KEPT_IDLE
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


@pytest.mark.skipif(sys.platform != "linux", reason="counts descriptors in /proc")
def test_subscribing_and_unsubscribing_leaves_no_resources(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("chat", String)

    def meet() -> weakref.ref[Inbox]:
        inbox = Inbox()
        subscriber = listener.subscribe("chat", String, inbox)
        wait_until_connected(publisher)
        publisher.publish(String("x"))
        inbox.wait()
        subscriber.unregister()
        wait_until(lambda: publisher.connection_count == 0)
        return weakref.ref(inbox)

    def count() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), threading.active_count()

    meet()
    before = count()
    callbacks = [meet() for _ in range(50)]
    # Each node calls the master once a second over its own connection; both ends are in this process.
    # And each node keeps idle threads, of which it starts more on a busy machine.
    most = (before[0] + 4, before[1] + 2 * KEPT_IDLE)
    wait_until(
        lambda: all(now <= limit for now, limit in zip(count(), most, strict=True)),
        what=lambda: f"{before} became {count()}; threads: {[each.name for each in threading.enumerate()]}",
    )

    def are_gone() -> bool:  # a thread may keep the last one for a moment
        gc.collect()
        return [callback() for callback in callbacks] == [None] * 50

    wait_until(are_gone)
