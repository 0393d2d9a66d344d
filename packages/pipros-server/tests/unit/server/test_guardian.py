"""The pending stops of the guardian: when each is published, and how often."""

import json
import os
import sys
import threading
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.msg import load_message_class
from pipros_server import guardian_process
from pipros_server.guardian_process import REPEAT_S, REPETITIONS, GuardianProcess, Stops
from tests.support.waiting import wait_until


@pytest.fixture
def published() -> list[tuple[str, Any]]:
    return []


@pytest.fixture
def stops(published: list[tuple[str, Any]]) -> Stops:
    return Stops(lambda key, message: published.append((key, message)))


def test_a_stop_is_published_when_its_time_has_come_and_then_repeated(
    stops: Stops, published: list[tuple[str, Any]]
) -> None:
    stops.arm("/a", "", "zero", 10.0)
    assert (stops.run(9.9), published) == (10.0, [])
    now_s: float | None = 10.0
    while now_s is not None:
        now_s = stops.run(now_s)
    assert published == [("/a", "zero")] * REPETITIONS


def test_another_act_postpones_the_stop_and_ends_its_repetitions(
    stops: Stops, published: list[tuple[str, Any]]
) -> None:
    stops.arm("/a", "", "zero", 10.0)
    stops.run(10.0)
    stops.arm("/a", "", "zero", 20.0)
    assert (stops.run(10.0 + REPEAT_S), len(published)) == (20.0, 1)


def test_a_goal_that_is_sent_again_does_not_postpone_its_end(
    stops: Stops, published: list[tuple[str, Any]]
) -> None:
    stops.arm("/a", "mine", "cancel", 10.0)
    stops.arm("/a", "mine", "cancel", 19.0)
    stops.arm("/a", "other", "cancel", 19.0)
    assert (stops.run(9.9), published) == (10.0, [])
    stops.run(10.0)
    stops.arm("/a", "mine", "cancel", 29.0)  # neither does it end the repetitions
    assert stops.run(10.0 + REPEAT_S) == 10.0 + 2 * REPEAT_S
    assert published == [("/a", "cancel")] * 2


def test_an_act_ends_a_halt_which_replaces_no_other_stop(
    stops: Stops, published: list[tuple[str, Any]]
) -> None:
    stops.arm("/cmd_vel", "", "slow down", 12.0)
    stops.halt("/cmd_vel", "zero", 10.0, REPETITIONS)
    stops.run(10.0)
    stops.arm("/drive/cancel", "next", "cancel", 30.0, "/cmd_vel")
    assert stops.run(10.0 + REPEAT_S) == 12.0
    stops.halt("/cmd_vel", "zero", 11.0, 1)
    assert stops.run(11.0) == 12.0
    stops.halt("/cmd_vel", "zero", 11.5, REPETITIONS)
    stops.arm("/cmd_vel", "", "slow down", 13.0)  # a velocity, not a goal
    assert stops.run(11.5) == 13.0
    assert published == [("halt /cmd_vel", "zero")] * 2


def test_the_end_of_the_input_stops_everything_but_what_was_disarmed(
    stops: Stops, published: list[tuple[str, Any]]
) -> None:
    for key, identity in (("/a", ""), ("/b", "1"), ("/b", "2"), ("/c", "")):
        stops.arm(key, identity, identity, 1e9)
    stops.disarm("/c", "")
    stops.stop_all(5.0)
    stops.run(5.0)
    assert published == [("/a", ""), ("/b", "1"), ("/b", "2")]


@given(acts=st.lists(st.tuples(st.floats(0, 10), st.sampled_from(["/a", "/b"])), max_size=20))
def test_every_last_act_is_stopped_within_its_limit(acts: list[tuple[float, str]]) -> None:
    published: list[tuple[str, float]] = []
    now_s = 0.0
    stops = Stops(lambda key, _: published.append((key, now_s)))
    last: dict[str, float] = {}
    for gap_s, key in acts:
        end_s = now_s + gap_s
        due_s = stops.run(now_s)
        while due_s is not None and due_s <= end_s:
            now_s = due_s
            due_s = stops.run(now_s)
        now_s = end_s
        stops.arm(key, "", None, now_s + 1.0)
        last[key] = now_s
    due_s = stops.run(now_s)
    while due_s is not None:
        now_s = due_s
        due_s = stops.run(now_s)
    for key, acted_s in last.items():
        assert any(found == key and at_s == acted_s + 1.0 for found, at_s in published)


# The guardian's process with a node that records what is published.


RESULT: Any = load_message_class("actionlib_tutorials/FibonacciActionResult")


WATCH = {
    "op": "watch", "key": "/fibonacci/cancel", "type": "actionlib_msgs/GoalID", "limit_s": 3000,
    "body": "00" * 12,
    "halt": {"topic": "/cmd_vel", "type": "geometry_msgs/Twist", "body": "00" * 48, "result": RESULT._type},
}  # fmt: skip


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
