"""Pings of nodes that are functions: output, counts and waits."""

from collections.abc import Callable
from itertools import count
from socket import gaierror
from typing import Any, cast

import pytest

from pipros.basics.errors import Unreachable
from pipros.net.rpc_client import Fault
from pipros.node import Node
from pipros_tools.graph.listening import Listening, wait_for_topic
from pipros_tools.graph.message_path import describe_path
from pipros_tools.graph.ping import ping, ping_all
from tests.support.table_master import TableMaster

API = "http://robot:1234/"


def master(**apis: str) -> TableMaster:
    state = [[["/t", [f"/{name}" for name in apis]]], [], []]
    answers = {("lookupNode", f"/{name}"): api for name, api in apis.items()}
    return TableMaster({("getSystemState",): state, **answers})


class Run:
    """One run of `ping`, with a clock that advances by 2 ms at each call."""

    def __init__(self, ask: Callable[[str, str], object], server: TableMaster | None = None) -> None:
        self.lines: list[str] = []
        self.complaints: list[str] = []
        self.pauses: list[float] = []
        self._ask = ask
        self._server = server or master(node=API)

    def of(self, node: str = "/node", pings: int | None = 1) -> bool:
        ticks = count()
        return ping(
            self._server, node, count=pings, say=self.lines.append, complain=self.complaints.append,
            pause=self.pauses.append, ask=self._ask, clock=lambda: next(ticks) * 0.002,
        )  # fmt: skip


def failing(cause: BaseException) -> Callable[[str, str], object]:
    def ask(_api: str, _caller_id: str) -> object:
        try:
            raise cause
        except OSError:
            raise Unreachable(API, "no response in time")  # noqa: B904  # as RpcClient raises it

    return ask


def test_each_response_is_printed_with_its_time_and_finally_the_mean() -> None:
    run = Run(lambda api, caller_id: (api, caller_id))

    assert run.of(pings=3)
    assert run.lines == [
        "pinging /node with a timeout of 3.0s",
        *[f"xmlrpc reply from {API}\ttime=2.000000ms"] * 3,
        "ping average: 2.000000ms",
    ]
    assert (run.pauses, run.complaints) == ([1.0, 1.0], [])


def test_a_fault_is_a_valid_response() -> None:
    def ask(_api: str, _caller_id: str) -> object:
        raise Fault(1, "no such method")

    assert Run(ask).of()


@pytest.mark.parametrize(("cause", "complaint"), [
    (ConnectionRefusedError(), f"ERROR: connection refused to [{API}]"),
    (gaierror(), "ERROR: Unknown host [robot] for node [/node]"),
    (TimeoutError(), "connection to [/node] timed out"),
    (ConnectionResetError(), "ERROR: communication with node [/node] failed: cannot reach"),
])  # fmt: skip
def test_the_reason_of_a_missing_answer_is_printed(cause: BaseException, complaint: str) -> None:
    run = Run(failing(cause))

    assert not run.of(pings=None)
    first, *advice = run.complaints
    assert first.startswith(complaint)
    assert len(advice) == ("Unknown host" in complaint)
    assert all(each.startswith("This machine cannot resolve the name [robot]: set ROS_IP") for each in advice)


def test_an_unknown_node_is_not_pinged() -> None:
    run = Run(failing(AssertionError("asked")))

    assert not run.of("/nobody")
    assert (run.complaints, run.lines) == (["cannot ping [/nobody]: unknown node"], [])


def test_a_node_that_moved_is_pinged_at_its_new_address_after_a_pause() -> None:
    server = master(node=API)
    asked: list[str] = []

    def ask(api: str, caller_id: str) -> object:
        asked.append(api)
        if len(asked) == 1:
            server.answers["lookupNode", "/node"] = "http://robot:5678/"
            return failing(ConnectionRefusedError())(api, caller_id)
        return [1, "", 4711]

    run = Run(ask, server)

    assert run.of()
    assert asked == [API, "http://robot:5678/"]
    assert run.complaints == [f"node url has changed from [{API}] to [http://robot:5678/], retrying to ping"]
    assert run.pauses == [1.0]


def test_ctrl_c_ends_with_the_mean_so_far() -> None:
    answers = iter([None, None])

    def ask(_api: str, _caller_id: str) -> object:
        try:
            return next(answers)
        except StopIteration:
            raise KeyboardInterrupt from None

    run = Run(ask)

    assert run.of(pings=None)
    assert run.lines[-1] == "ping average: 2.000000ms"


def test_nodes_are_pinged_and_grouped_by_whether_they_respond() -> None:
    server = master(good="http://good:1/", bad="http://bad:1/")
    lines: list[str] = []

    def ask(api: str, caller_id: str) -> object:
        return failing(TimeoutError())(api, caller_id) if "bad" in api else 1

    assert ping_all(server, lines.append, complain=lambda _: None, ask=ask) == (["/good"], ["/bad"])
    assert lines[0] == "Will ping the following nodes: \n * /bad\n * /good\n"


# Waits for topics, and subscriptions of tools, with a master and a node from tables.


class Waiting:
    """`wait_for_topic` on a master that learns new types at each pause."""

    def __init__(self, *types: list[list[str]]) -> None:
        self._types = list(types)
        self.warnings: list[str] = []
        self.pauses = 0
        self._master = TableMaster({("getTopicTypes",): self._types.pop(0)})

    def of(self, name: str) -> tuple[str, str]:
        part = wait_for_topic(self._master, name, warn=self.warnings.append, pause=self._next)
        return part.topic, describe_path(part.path)

    def _next(self, _seconds: float) -> None:
        self.pauses += 1
        self._master.answers["getTopicTypes",] = self._types.pop(0)


STRING = ["/chatter", "std_msgs/String"]


def test_a_known_topic_returns_at_once() -> None:
    waiting = Waiting([STRING])

    assert waiting.of("/chatter/data") == ("/chatter", "/data")
    assert (waiting.warnings, waiting.pauses) == ([], 0)


def test_a_topic_is_waited_for_with_one_warning() -> None:
    waiting = Waiting([], [], [STRING])

    assert waiting.of("/chatter") == ("/chatter", "")
    assert waiting.warnings == ["WARNING: topic [/chatter] does not appear to be published yet"]
    assert waiting.pauses == 2


def test_a_path_with_an_unknown_field_may_be_a_topic() -> None:
    waiting = Waiting([STRING], [STRING, ["/chatter/extra", "std_msgs/Int32"]])

    assert waiting.of("/chatter/extra") == ("/chatter/extra", "")


def test_a_topic_of_an_unknown_type_may_have_any_field() -> None:
    assert Waiting([["/odd", "nowhere/Thing"]]).of("/odd/a/b") == ("/odd", "/a/b")


def test_a_malformed_index_warns_and_selects_the_whole_message() -> None:
    waiting = Waiting([STRING])

    assert (waiting.of("/chatter/data[x]"), len(waiting.warnings)) == (("/chatter", ""), 1)


class FakeNode:
    """Keeps the callback, so that a test can call it."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Callable[[Any], object]] = {}
        self.shutdown: Callable[[], object]

    def on_shutdown(self, call: Callable[[], object]) -> None:
        self.shutdown = call

    def subscribe(
        self, topic: str, _class: Any, callback: Callable[[Any], object], *, tcp_nodelay: bool
    ) -> None:
        _ = tcp_nodelay
        self.callbacks[topic] = callback


@pytest.fixture
def node() -> FakeNode:
    return FakeNode()


def listening_on(node: FakeNode) -> Listening:
    return Listening(cast("Node", node))


def test_messages_reach_the_callback_until_the_end(node: FakeNode) -> None:
    received: list[Any] = []
    listening = listening_on(node)
    listening.subscribe("/a", received.append)

    node.callbacks["/a"]("one")
    assert not listening.wait(0)
    listening.finish()
    node.callbacks["/a"]("two")

    assert received == ["one"]
    assert listening.wait(0)


def test_an_error_of_a_callback_is_raised_by_the_wait(node: FakeNode) -> None:
    def fail(_message: Any) -> None:
        raise ValueError("broken")

    listening = listening_on(node)
    listening.subscribe("/a", fail)
    node.callbacks["/a"]("one")

    with pytest.raises(ValueError, match="broken"):
        listening.wait()


def test_the_end_of_the_node_ends_the_wait(node: FakeNode) -> None:
    listening = listening_on(node)
    node.shutdown()

    assert listening.wait()
