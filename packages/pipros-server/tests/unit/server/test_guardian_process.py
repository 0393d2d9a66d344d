"""The guardian's process with a node that records what is published."""

from __future__ import annotations

import json
import os
import sys
import threading
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros_server import guardian_process
from pipros_server.guardian_process import REPETITIONS, GuardianProcess
from tests.support.waiting import wait_until

RESULT: Any = load_message_class("actionlib_tutorials/FibonacciActionResult")
WATCH = {
    "op": "watch",
    "key": "/fibonacci/cancel",
    "type": "actionlib_msgs/GoalID",
    "limit_s": 3000,
    "body": "00" * 12,
    "halt": {
        "topic": "/cmd_vel",
        "type": "geometry_msgs/Twist",
        "body": "00" * 48,
        "result": RESULT._type,
    },
}


class RecordingNode:
    """Has no master; records the topics of publications, and the callback of results."""

    connection_count = 0

    def __init__(self) -> None:
        self.published: list[str] = []
        self.master = self
        self.ended: Any = None

    def get_system_state(self) -> tuple[list[Any], list[Any], list[Any]]:
        return [], [], []

    def advertise(self, topic: str, *_: object, **__: object) -> Any:
        class Recorder:
            connection_count = 0

            def publish(_, message: object) -> None:  # noqa: N805
                self.published.append(topic)

        return Recorder()

    def subscribe(self, topic: str, message_class: object, callback: Any, **_: object) -> None:
        self.ended = callback


def test_a_result_that_arrives_before_the_line_about_its_goal_ends_the_goal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(guardian_process, "EARLY_S", 1e9)
    (lines, write), (read, output) = os.pipe(), os.pipe()
    node: Any = RecordingNode()
    with (
        os.fdopen(read) as answers,
        os.fdopen(lines) as stdin,
        os.fdopen(output, "w") as stdout,
        os.fdopen(write, "w", buffering=1) as requests,
    ):
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(sys, "stdout", stdout)
        guardian = GuardianProcess(node)
        found: list[str] = []
        runs = guardian.read, guardian.run, lambda: found.extend(filter(str.strip, answers))
        threads = [threading.Thread(target=run, daemon=True) for run in runs]
        for each in threads:
            each.start()

        def send(**line: object) -> None:
            print(json.dumps(line), file=requests)

        send(**WATCH)
        wait_until(lambda: found == ["/fibonacci/cancel\n"])
        result = RESULT()
        result.status.goal_id.id = "mine"
        node.ended(result)
        send(op="arm", key="/fibonacci/cancel", id="mine")
        wait_until(lambda: node.published == ["/cmd_vel"] * REPETITIONS)
        send(op="arm", key="/fibonacci/cancel", id="mine")  # a result ends one goal
        requests.close()
        for each in threads[:2]:
            each.join()
        stdout.close()
        threads[2].join()
    assert "/fibonacci/cancel" in node.published
    assert json.loads(found[1])["id"] == "mine"
