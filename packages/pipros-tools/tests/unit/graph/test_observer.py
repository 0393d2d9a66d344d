"""GraphObservation of a running system: connections, rates, and unresponsive nodes."""

from typing import Any

import pytest

from pipros.basics.errors import Unreachable
from pipros_tools.graph.observer import (
    ANSWER_DEADLINE_S,
    ASKED_AT_ONCE,
    CALLS_PER_POLL,
    SystemObserver,
    Traffic,
)
from pipros_tools.graph.system_state import TopicConnection

LEVEL = TopicConnection("/talker", "/level", "/listener")


class Nodes:
    """A master, its nodes and a clock. `/talker` publishes `/level` to `/listener`."""

    caller_id = "/test"

    def __init__(self) -> None:
        self.now_s = 100.0
        self.is_up = True
        self.silent: set[str] = set()
        self.silence_s = 0.0
        self.asked: list[str] = []
        self.messages = 0
        self.more: list[str] = []
        self.answers: dict[str, tuple[Any, Any]] = {}
        self.types = {"/talker": "std_msgs/String", "/listener": "std_msgs/String"}
        self.asked_types: list[str] = []

    def get_system_state(self) -> list[list[list[Any]]]:
        if not self.is_up:
            raise Unreachable("master http://x", "connection refused")
        more = [["/more", self.more]] if self.more else []
        return [[["/level", ["/talker"]], *more], [["/level", ["/listener"]]], []]

    def get_topic_types(self) -> list[list[str]]:
        return [["/level", "std_msgs/String"]]

    def lookup_node(self, node: str) -> str:
        return f"http://host:1{node}"

    def ask(self, uri: str) -> tuple[Any, Any]:
        name = "/" + uri.rpartition("/")[2]
        self.asked.append(name)
        if name in self.silent:
            self.now_s += self.silence_s
            raise Unreachable(name, "no answer")
        return self.answers.get(name) or self.usual_answers(name)

    def ask_types(self, uri: str) -> tuple[Any, Any]:
        name = "/" + uri.rpartition("/")[2]
        self.asked_types.append(name)
        rows = [1, "", [["/level", self.types[name]], "malformed"]]
        return (rows, [1, "", []]) if name == "/talker" else ([1, "", []], rows)

    def usual_answers(self, name: str) -> tuple[Any, Any]:
        if name == "/talker":
            info = [[7, "/listener", "o", "TCPROS", "/level", True, ""]]
            statistics = [["/level", 0, [[7, self.messages * 10, self.messages, True]]]]
            return [1, "", info], [1, "", [statistics, [], []]]
        if name == "/listener":
            return [1, "", [[3, "http://host:1/talker", "i", "TCPROS", "/level", True]]], [
                1, "", [[], [], []]
            ]  # fmt: skip
        return [1, "", []], [1, "", [[], [], []]]


@pytest.fixture
def nodes() -> Nodes:
    return Nodes()


@pytest.fixture
def observer(nodes: Nodes) -> SystemObserver:
    return SystemObserver(nodes, ask=nodes.ask, ask_types=nodes.ask_types, now_s=lambda: nodes.now_s)


def test_connections_are_reported_by_either_end(nodes: Nodes, observer: SystemObserver) -> None:
    assert dict(observer.poll().connections) == {LEVEL: None}
    assert dict(observer.poll().transports) == {LEVEL: "TCPROS"}
    nodes.silent = {"/talker"}
    nodes.now_s += 10
    found = observer.poll()
    assert (dict(found.connections), found.unreachable) == ({LEVEL: None}, {"/talker"})


def test_rates_are_differences_over_several_responses(nodes: Nodes, observer: SystemObserver) -> None:
    observer.poll()
    for _ in range(3):
        nodes.now_s += 2
        nodes.messages += 40
        found = observer.poll()
    assert found.connections[LEVEL] == Traffic(20.0, 200.0)


def test_regular_traffic_has_an_interval_and_then_the_time_since_it_ended(nodes, observer) -> None:
    for _ in range(6):
        nodes.now_s += 2
        nodes.messages += 40
        found = observer.poll()
    assert found.connections[LEVEL] == Traffic(20.0, 200.0, 0.0, 0.05)
    for _ in range(7):
        nodes.now_s += 2
        found = observer.poll()
    assert found.connections[LEVEL] == Traffic(0.0, 0.0, 14.0, 0.05)


def test_a_restarted_node_has_no_rate(nodes: Nodes, observer: SystemObserver) -> None:
    nodes.messages = 1000
    observer.poll()
    nodes.messages = 3
    nodes.now_s += 2
    assert observer.poll().connections[LEVEL] is None


def test_an_answer_is_used_for_a_second(nodes: Nodes, observer: SystemObserver) -> None:
    observer.poll()
    nodes.now_s += 0.5
    observer.poll()
    assert sorted(nodes.asked) == ["/listener", "/talker"]
    nodes.now_s += 0.6
    observer.poll()
    assert len(nodes.asked) == 4


def test_a_silent_node_is_polled_less_often_until_it_responds(nodes: Nodes, observer: SystemObserver) -> None:
    nodes.silent = {"/talker"}
    for _ in range(60):
        found = observer.poll()
        nodes.now_s += 1
    assert found.nodes["/talker"].error
    assert nodes.asked.count("/talker") < 12
    nodes.silent = set()
    nodes.now_s += 10
    assert observer.poll().unreachable == set()


def test_many_nodes_are_polled_in_turn(nodes: Nodes, observer: SystemObserver) -> None:
    nodes.more = [f"/node{number}" for number in range(150)]
    observer.poll()
    assert len(nodes.asked) == CALLS_PER_POLL
    for _ in range(2):
        observer.poll()
    assert sorted(nodes.asked) == sorted(["/talker", "/listener", *nodes.more])


def test_silent_nodes_delay_a_poll_by_one_timeout_and_do_not_displace_the_others(nodes, observer) -> None:
    nodes.more = [f"/node{number}" for number in range(150)]
    nodes.silent, nodes.silence_s = set(nodes.more), ANSWER_DEADLINE_S + 0.1
    observer.poll()
    assert len(nodes.asked) <= ASKED_AT_ONCE
    while len(set(nodes.asked)) < 152:  # until each has been called
        observer.poll()
    nodes.asked.clear()
    for _ in range(8):
        observer.poll()
        nodes.now_s += 10  # every node is due
    assert nodes.asked.count("/talker") >= 4
    assert nodes.asked.count("/listener") >= 4


def test_new_silent_nodes_leave_known_ones_their_share_of_the_calls(nodes, observer: SystemObserver) -> None:
    observer.poll()
    nodes.more = [f"/node{number}" for number in range(300)]
    nodes.silent = set(nodes.more)
    nodes.asked.clear()
    for _ in range(4):
        nodes.now_s += 2
        nodes.messages += 40
        observer.poll()
    assert nodes.asked.count("/talker") == 4
    assert any(name in nodes.silent for name in nodes.asked)


def test_many_known_nodes_leave_new_ones_their_share_of_the_calls(nodes, observer: SystemObserver) -> None:
    nodes.more = [f"/known{number}" for number in range(3 * CALLS_PER_POLL)]
    for _ in range(4):
        observer.poll()
    nodes.more += [f"/new{number}" for number in range(CALLS_PER_POLL)]
    for _ in range(2):
        nodes.now_s += 2  # every node is due
        nodes.asked.clear()
        observer.poll()
        assert len([name for name in nodes.asked if name.startswith("/new")]) == CALLS_PER_POLL // 2
        assert len(nodes.asked) == CALLS_PER_POLL


def test_without_its_master_the_last_state_is_kept(nodes: Nodes, observer: SystemObserver) -> None:
    before = observer.poll()
    nodes.is_up = False
    found = observer.poll()
    assert found.error
    assert (found.state, found.connections) == (before.state, before.connections)


@pytest.mark.parametrize("answer", [None, [], [0, "no", []], [1, "", "x"], [1, "", []] * 2])
def test_a_malformed_answer_is_an_error_of_that_node(nodes, observer: SystemObserver, answer: Any) -> None:
    nodes.answers["/talker"] = answer, [1, "", [[], [], []]]
    assert "getBusInfo must return" in observer.poll().nodes["/talker"].error


def without_connection(nodes: Nodes) -> None:
    nodes.answers = dict.fromkeys(("/talker", "/listener"), ([1, "", []], [1, "", [[], [], []]]))


def test_ends_with_different_types_are_reported_while_they_lack_a_connection(nodes, observer) -> None:
    assert not observer.poll().wrong_types
    assert not nodes.asked_types  # the ends are connected
    without_connection(nodes)
    nodes.now_s += 10
    assert not observer.poll().wrong_types
    nodes.types["/listener"] = "std_msgs/Int32"
    nodes.now_s += 10
    assert observer.poll().wrong_types == {LEVEL: ("std_msgs/String", "std_msgs/Int32")}
    assert sorted(nodes.asked_types) == ["/listener", "/listener", "/talker", "/talker"]
    nodes.now_s += 1
    assert observer.poll().wrong_types[LEVEL].text == "sent std_msgs/String, wanted std_msgs/Int32"
    assert len(nodes.asked_types) == 4  # the responses are used for some seconds
    nodes.types["/listener"] = "*"
    nodes.now_s += 10
    assert not observer.poll().wrong_types


def test_a_node_that_does_not_answer_has_no_wrong_type(nodes: Nodes, observer: SystemObserver) -> None:
    without_connection(nodes)
    nodes.types["/listener"] = "std_msgs/Int32"
    nodes.silent.add("/talker")
    assert not observer.poll().wrong_types
    assert not nodes.asked_types
