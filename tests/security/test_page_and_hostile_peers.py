"""The page while browsers and peers send what no honest one sends."""

from __future__ import annotations

import json

from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def test_browsers_watch_a_bounded_number_of_topics(ros: RosSystem) -> None:
    ros.serve_master()
    with Page(ros, PIPROS_LIMITS="page_topics=5").connect() as browser:
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
        browser.socket.send(json.dumps({"id": 0, "stop": True}))
        wait_until(lambda: not ros.subscribers("/nothing_0"))
        assert next(browser.watch("topic", name="/another"))["name"] == "/another"
