"""Loaders and managers of nodelets, of pipros and genuine ones in all combinations."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Image: Any = load_message_class("sensor_msgs/Image")


@pytest.mark.parametrize("manager_side", ["pipros", "genuine"])
@pytest.mark.parametrize("loader_side", ["pipros", "genuine"])
def test_a_nodelet_has_the_same_names_and_ends_with_its_loader(
    ros: RosSystem, manager_side: str, loader_side: str
) -> None:
    ros.serve_master()
    program = {"pipros": ["rosrun", "nodelet", "nodelet"], "genuine": ["/usr/lib/nodelet/nodelet"]}
    manager = getattr(ros, manager_side).start(*program[manager_side], "manager", "__name:=mgr", "__ns:=/r")
    loader = getattr(ros, loader_side).start(
        *program[loader_side],
        *("load", "image_proc/debayer", "mgr", "__ns:=/r", "__name:=d", "image_color:=/colors"),
    )
    names, inbox = load_service_class("nodelet/NodeletList"), Inbox()
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        listed = node.client("/r/mgr/list", names)
        assert listed.wait_until_available(60, pause=node.clock.sleep, report=print)
        wait_until(lambda: listed.call(names._request_class()).nodelets == ["/r/d"], 60)
        ros.wait_for_publisher("/colors")
        assert ros.publishers("/colors") == ["/r/mgr"]
        assert ros.publishers("/r/image_mono") == ["/r/mgr"]
        assert ros.subscribers("/r/image_raw") == []
        wait_until(lambda: node.params.has("/r/d/debayer"), 60)
        assert node.params.get("/r/d/debayer") == 0
        node.subscribe("/colors", Image, inbox)
        camera = node.advertise("/r/image_raw", Image)
        row, next_row = bytes([200, 100] * 4), bytes([100, 50] * 4)
        mosaic = Image(height=8, width=8, step=8, encoding="bayer_rggb8", data=(row + next_row) * 4)

        def sent() -> bool:
            camera.publish(mosaic)
            return bool(inbox.messages)

        wait_until(sent, 60)
        image = inbox.messages[0]
        assert (image.encoding, image.data) == ("bgr8", bytes([50, 100, 200] * 64))
        loader.press_ctrl_c()
        assert loader.wait() == 0
        wait_until(lambda: listed.call(names._request_class()).nodelets == [])
    assert manager.is_running
