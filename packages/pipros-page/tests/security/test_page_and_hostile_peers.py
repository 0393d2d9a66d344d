"""The page with hostile browsers and peers."""

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from pipros.basics.env import Environment
from pipros.msg.dynamic import message_classes_from_text
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcServer
from pipros.node import Node
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def test_browsers_watch_a_bounded_number_of_topics_and_leave_some_to_others(ros: RosSystem) -> None:
    ros.serve_master()
    page = Page(ros, PIPROS_LIMITS="page_topics=10")
    with page.connect() as browser, page.connect() as other:
        for number in range(8):
            arguments = {"name": f"/nothing_{number}"}
            browser.socket.send(json.dumps({"id": number, "view": "topic", "args": arguments}))
        refused: set[int] = set()
        while len(refused) < 3:
            answer = json.loads(browser.socket.recv(timeout=30))
            if "error" in answer:
                assert "page_topics" in answer["error"]
                refused.add(answer["id"])
        subscribed = [f"/nothing_{number}" for number in range(8) if number not in refused]
        wait_until(lambda: all(ros.subscribers(topic) for topic in subscribed))
        assert not any(ros.subscribers(f"/nothing_{number}") for number in refused)
        assert next(other.watch("topic", name="/of_another_browser"))["name"] == "/of_another_browser"
        stopped = next(number for number in range(8) if number not in refused)
        browser.socket.send(json.dumps({"id": stopped, "stop": True}))
        wait_until(lambda: not ros.subscribers(f"/nothing_{stopped}"))
        assert next(browser.watch("topic", name="/another"))["name"] == "/another"


@pytest.mark.parametrize(("topic", "view", "type_name", "definition"), [
    ("/tf", "frames", "tf2_msgs/TFMessage", "string[] transforms\n"),
    ("/diagnostics", "diagnostics", "diagnostic_msgs/DiagnosticArray", "string[] status\n"),
    ("/rosout_agg", "console", "rosgraph_msgs/Log", "string header\n"),
    ("/image", "image", "sensor_msgs/Image", "string encoding\n"),
    ("/image", "image", "sensor_msgs/CompressedImage", "string format\n"),
])  # fmt: skip
def test_a_definition_that_differs_is_named_in_its_tab(
    ros: RosSystem, topic: str, view: str, type_name: str, definition: str
) -> None:
    ros.serve_master()
    another = message_classes_from_text(type_name, definition)[type_name]
    with Node("liar", environment=Environment(master_uri=ros.master_uri)) as liar:
        field = another.__slots__[0]
        texts = ["x"] if definition.startswith("string[]") else "rgb8"
        message = another(**{field: texts})
        liar.advertise(topic, another, latch=True).publish(message)
        page = Page(ros)
        with page.connect() as browser:
            views = browser.watch(view, **({"name": topic} if view == "image" else {}))
            error = next(data["error"] for data in views if data.get("error"))
            assert f"/liar publishes [{type_name}/{another._md5sum}] instead of [{type_name}/" in error
            for _ in range(20):
                liar.advertise(topic, another, latch=True).publish(message)
            assert browser.act("about")["control"] is False
        assert "Traceback" not in page.process.output
        assert "bad callback" not in page.process.output


def test_statistics_that_json_lacks_do_not_end_the_graph(ros: RosSystem) -> None:
    ros.serve_master()
    with strange_node(ros) as count, Page(ros).connect() as browser:
        graph = browser.watch("graph", mode="all")
        while count() < 5:
            assert next(graph).get("error", "") == ""
        connections = next(
            data["connections"] for data in browser.watch("node", name="/strange") if data["connections"]
        )
        assert ["/strange", "/level", "/peer", None, None, "TCPROS"] in [each[:6] for each in connections]


@contextmanager
def strange_node(ros: RosSystem) -> Iterator[Callable[[], int]]:
    """A registered node that reports infinite statistics; yields the number of queries."""
    asked: list[str] = []
    row = [1, "/peer", "o", "TCPROS", "/level"]
    loop = BackgroundLoop("strange node")
    loop.start()

    def statistics(caller: str) -> Any:
        asked.append(caller)
        numbers = [math.inf, math.nan, -math.inf, 2.0**70]
        return [1, "", [[["/level", 0, [[1, numbers[len(asked) % 4], math.inf, True]]]], [], []]]

    server = RpcServer({"getBusInfo": lambda _: [1, "", [row]], "getBusStats": statistics})
    loop.run(server.start())
    master: Any = ServerProxy(ros.master_uri)
    for name, register in (("/strange", master.registerPublisher), ("/peer", master.registerSubscriber)):
        assert register(name, "/level", "std_msgs/String", f"http://127.0.0.1:{server.port}/")[0] == 1
    master("close")()
    try:
        yield lambda: len(asked)
    finally:
        loop.run(server.stop())
        loop.stop()
