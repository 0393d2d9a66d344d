"""rosbridge_suite#86, morse#770: a subscriber out of wifi range blocked the publisher for all others."""

import socket
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from pipros.wire.header import encode_header
from tests.support.nodes import Inbox, MakeNode, wait_until_connected

Image: Any = load_message_class("sensor_msgs/Image")


@pytest.mark.parametrize("queue_size", [None, 1, 10])
def test_a_subscriber_that_does_not_read_does_not_affect_others(
    make_node: MakeNode, queue_size: int | None
) -> None:
    camera, viewer, inbox = make_node("camera", limits=Limits(stall_s=0.05)), make_node("viewer"), Inbox()
    publisher = camera.advertise("image", Image, queue_size=queue_size)
    with socket.create_connection(("127.0.0.1", camera.endpoints.port), 10) as vanished:
        vanished.sendall(encode_header({"topic": "/image", "md5sum": "*", "callerid": "/gone"}))
        viewer.subscribe("image", Image, inbox)
        wait_until_connected(publisher, 2)
        image = Image(data=b"x" * 1_000_000)
        for count in range(1, 31):
            publisher.publish(image)
            inbox.wait(count)
        assert publisher.statistics()["dropped"] > 0
