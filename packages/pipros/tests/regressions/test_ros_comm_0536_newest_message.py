"""ros_comm#536, #1901: with queue_size=1 a slow callback saw old images, unless buff_size was guessed."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.net.timings import LinkTimings
from pipros.node.timings import NodeTimings
from tests.support.nodes import MakeNode, wait_until_connected
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")


@pytest.mark.parametrize("size", [100, 20_000, 300_000])
def test_queue_size_1_is_the_newest_message_whatever_its_size(make_node: MakeNode, size: int) -> None:
    every_callback_is_slow = NodeTimings(links=LinkTimings(slow_delivery_s=0.0))
    camera, detector = make_node("camera"), make_node("detector", timings=every_callback_is_slow)
    seen: list[int] = []
    entered, gate = threading.Event(), threading.Event()

    def detect(image: Any) -> None:
        seen.append(image.data[0])
        entered.set()
        gate.wait(60)

    detector.subscribe("image", Image, detect, queue_size=1)
    publisher = camera.advertise("image", Image, queue_size=1)
    wait_until_connected(publisher)
    publisher.publish(Image(data=bytes([0]) * size))
    assert entered.wait(60)
    for number in range(1, 20):
        publisher.publish(Image(data=bytes([number]) * size))
    gate.set()
    wait_until(lambda: seen[-1] == 19)
    assert len(seen) <= 4  # those in a full socket, and the newest
