"""The Master and Parameter API: codes, texts and values, as genuine rosmaster answers."""

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from pipros.master.api import MasterApi
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from tests.support.examples import examples

API = "http://h:1/"


class Case:
    def __init__(self) -> None:
        self.notices: list[Notice] = []
        self.api = MasterApi(Registry(), ParamTree(), notify=self._notify, shutdown=lambda _: True)
        self.api.uri = "http://master:11311/"

    def _notify(self, notices: Iterable[Notice]) -> None:
        self.notices += notices

    def call(self, method: str, *params: Any) -> list[Any]:
        answer: list[Any] = self.api.methods[method](*params)
        return answer


@pytest.fixture
def master() -> Case:
    return Case()


@pytest.mark.parametrize(("method", "error_value"), [
    ("getPid", -1), ("getUri", ""), ("getSystemState", [[], [], []]), ("registerPublisher", []),
    ("getParam", 0),
])  # fmt: skip
def test_wrong_calls_are_error_responses_not_faults(master: Case, method: str, error_value: Any) -> None:
    assert master.call(method) == [-1, "missing required caller_id parameter", error_value]
    assert master.call(method, 5) == [-1, "caller_id must be a string", error_value]
    assert master.call(method, "/n", *range(9)) == [-1, "Error: bad call arity", error_value]


@pytest.mark.parametrize(("method", "before", "after"), [
    ("lookupNode", (), ()), ("registerPublisher", (), ("x/Y", API)), ("registerPublisher", ("/t",), (API,)),
    ("registerService", ("/s",), (API,)), ("registerService", ("/s", "rosrpc://h:1"), ()),
    ("setParam", (), (1,)), ("searchParam", (), ()), ("getPublishedTopics", (), ()),
])  # fmt: skip
def test_names_and_uris_of_megabytes_are_refused(
    master: Case, method: str, before: tuple[Any, ...], after: tuple[Any, ...]
) -> None:
    far_down = "/x" * 10_000
    code, text, _ = master.call(method, "/n", *before, far_down, *after)
    assert (code, text[-31:]) == (-1, "is longer than 16384 characters")
    code, text, _ = master.call(method, far_down, *before, "/x", *after)
    assert (code, text) == (-1, "caller_id is longer than 16384 characters")
    assert master.call("setParam", "/n", "/text", far_down)[0] == 1


def test_names_are_resolved_beside_the_caller_and_private_ones_below_it(master: Case) -> None:
    assert master.call("registerSubscriber", "/ns/n", "t", "*", API) == [1, "Subscribed to [/ns/t]", []]
    assert master.call("registerSubscriber", "/ns/n", "~t", "*", API) == [1, "Subscribed to [/ns/n/t]", []]
    assert master.call("registerSubscriber", "/ns/n", "//a//t/", "*", API) == [1, "Subscribed to [/a/t]", []]


def test_registering_returns_and_notifies_the_other_side(master: Case) -> None:
    master.call("registerSubscriber", "/s", "/t", "x/Y", "http://s:1/")
    assert master.call("registerPublisher", "/p", "/t", "x/Y", API) == [
        1, "Registered [/p] as publisher of [/t]", ["http://s:1/"],
    ]  # fmt: skip
    assert master.notices == [Notice("/s", "http://s:1/", "publisherUpdate", ("/master", "/t", [API]))]
    assert master.call("registerSubscriber", "/s2", "/t", "x/Y", "http://s:2/")[2] == [API]


@pytest.mark.parametrize(("arguments", "text"), [
    (("", "a/B", API), "ERROR: parameter [topic] must be a non-empty string"),
    ((5, "a/B", API), "ERROR: parameter [topic] must be a non-empty string"),
    (("/a b", "a/B", API), "ERROR: parameter [topic] contains illegal chars"),
    (("/a:b", "a/B", API), "ERROR: parameter [topic] contains illegal chars"),
    (("/", "a/B", API), "ERROR: parameter [topic] cannot be the global namespace"),
    (("/t", "", API), "ERROR: parameter [topic_type] must be a non-empty string"),
    (("/t", "B", API), "ERROR: parameter [topic_type] is not a valid package resource name"),
    (("/t", "a/B/c", API), "ERROR: parameter [topic_type] is not a valid package resource name"),
    (("/t", "a/B", ""), "ERROR: parameter [caller_api] is not an XMLRPC URI"),
    (("/t", "a/B", "h:1"), "ERROR: parameter [caller_api] is not an RPC URI"),
])  # fmt: skip
def test_an_invalid_registration_is_refused_with_the_text_of_genuine_ros(
    master: Case, arguments: tuple[Any, ...], text: str
) -> None:
    assert master.call("registerPublisher", "/n", *arguments) == [-1, text, []]
    assert master.call("registerSubscriber", "/n", *arguments) == [-1, text, []]


def test_published_topics_are_those_below_a_subgraph_that_have_a_publisher(master: Case) -> None:
    master.call("registerPublisher", "/n", "/a/t", "x/Y", API)
    master.call("registerPublisher", "/n", "/b/t", "x/Y", API)
    master.call("registerSubscriber", "/n", "/a/only_heard", "x/Y", API)
    everything = [["/a/t", "x/Y"], ["/b/t", "x/Y"]]
    for subgraph, topics in (("", everything), ("/", everything), ("/a", everything[:1]), ("/a/t", [])):
        assert master.call("getPublishedTopics", "/n", subgraph) == [1, "current topics", topics]


def test_services_are_found_relative_to_the_caller(master: Case) -> None:
    master.call("registerService", "/ns/n", "srv", "rosrpc://h:5", API)
    assert master.call("lookupService", "/ns/x", "srv") == [1, "rosrpc URI: [rosrpc://h:5]", "rosrpc://h:5"]
    assert master.call("lookupService", "/x", "srv") == [-1, "no provider", ""]
    assert master.call("unregisterService", "/ns/n", "srv", "rosrpc://h:5")[2] == 1
    assert master.call("unregisterService", "/ns/n", "srv", "rosrpc://h:5")[2] == 0


def test_parameters_are_set_got_searched_and_deleted(master: Case) -> None:
    assert master.call("setParam", "/ns/n", "~gain", 1.5) == [1, "parameter /ns/n/gain set", 0]
    assert master.call("getParam", "/ns/n", "~gain") == [1, "Parameter [/ns/n/gain]", 1.5]
    assert master.call("hasParam", "/ns/n", "n") == [1, "/ns/n", True]
    assert master.call("searchParam", "/ns/n", "gain") == [1, "Found [/ns/n/gain]", "/ns/n/gain"]
    assert master.call("getParamNames", "/x") == [1, "Parameter names", ["/ns/n/gain"]]
    assert master.call("deleteParam", "/ns/n", "~gain") == [1, "parameter /ns/n/gain deleted", 0]
    assert master.call("getParam", "/ns/n", "~gain") == [-1, "Parameter [/ns/n/gain] is not set", 0]


def test_parameter_subscribers_are_notified_of_changes_and_deletions(master: Case) -> None:
    assert master.call("subscribeParam", "/s", API, "/w")[2] == {}
    master.call("setParam", "/x", "/w/g", 1)
    master.call("setParam", "/s", "/w/g", 2)
    master.call("deleteParam", "/x", "/w")
    assert [notice.params for notice in master.notices] == [("/master", "/w/g/", 1), ("/master", "/w/", {})]
    assert master.call("unsubscribeParam", "/s", API, "/w")[2] == 1
    assert master.call("unsubscribeParam", "/s", API, "/w")[2] == 1


def test_the_master_returns_its_uri(master: Case) -> None:
    assert master.call("getUri", "/n") == [1, "", "http://master:11311/"]
    assert master.call("getPid", "/n")[2] > 0
    assert master.call("shutdown", "/n", "bye") == [1, "shutdown", 0]


# Random calls to the master's API, compared with a simple model.


NODES = st.sampled_from(["/a", "/b", "/c"])


TOPICS = st.sampled_from(["/t", "/u"])


APIS = st.sampled_from(["http://x:1/", "http://y:2/"])


KEYS = st.lists(st.sampled_from("pqr"), min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))


VALUES = st.recursive(
    st.integers(0, 9), lambda inner: st.dictionaries(st.sampled_from("pqr"), inner, max_size=2)
)


class MasterMachine(RuleBasedStateMachine):
    """The model: a set of (role, node, key), the API of each node, and parameters as a flat dictionary."""

    def __init__(self) -> None:
        super().__init__()
        self.heard: dict[tuple[str, str], list[str]] = {}
        self.shutdowns: list[Notice] = []
        self.registry = Registry()
        self.api = MasterApi(self.registry, ParamTree(), notify=self.notify, shutdown=lambda _: True)
        self.registered: dict[tuple[str, str, str], None] = {}
        self.services: dict[str, tuple[str, str]] = {}
        self.apis: dict[str, str] = {}
        self.leaves: dict[tuple[str, ...], int] = {}
        self.namespaces: set[tuple[str, ...]] = set()

    def notify(self, notices: Any) -> None:
        for notice in notices:
            if notice.method == "publisherUpdate":
                self.heard[notice.node, notice.params[1]] = notice.params[2]
            elif notice.method == "shutdown":
                self.shutdowns.append(notice)

    def call(self, method: str, *params: Any) -> Any:
        code, _, value = self.api.methods[method](*params)
        return value if code == 1 else None

    # ---- the graph

    def is_leaving(self, node: str, api: str) -> bool:
        return any((notice.node, notice.api) == (node, api) for notice in self.shutdowns)

    @precondition(lambda self: self.shutdowns)
    @rule()
    def tell_to_shut_down(self) -> None:
        self.registry.notice_done(self.shutdowns.pop(0))

    def move(self, node: str, api: str) -> None:
        if self.apis.get(node, api) != api:
            for key in [key for key in self.registered if key[1] == node]:
                del self.registered[key]
            for service in [name for name, (owner, _) in self.services.items() if owner == node]:
                del self.services[service]
            for key in [key for key in self.heard if key[0] == node]:
                del self.heard[key]
        self.apis[node] = api

    @rule(node=NODES, topic=TOPICS, api=APIS)
    def publish(self, node: str, topic: str, api: str) -> None:
        is_leaving = self.is_leaving(node, api)
        assert self.call("registerPublisher", node, topic, "x/Y", api) is not None
        if is_leaving:
            return
        self.move(node, api)
        self.registered[("p", node, topic)] = None

    @rule(node=NODES, topic=TOPICS, api=APIS)
    def subscribe(self, node: str, topic: str, api: str) -> None:
        is_leaving = self.is_leaving(node, api)
        answer = self.call("registerSubscriber", node, topic, "x/Y", api)
        if is_leaving:
            return
        self.move(node, api)
        self.registered[("s", node, topic)] = None
        self.heard[node, topic] = answer

    @rule(node=NODES, topic=TOPICS, api=APIS, role=st.sampled_from("ps"))
    def leave(self, node: str, topic: str, api: str, role: str) -> None:
        method = "unregisterPublisher" if role == "p" else "unregisterSubscriber"
        was_there = self.apis.get(node) == api and (role, node, topic) in self.registered
        assert self.call(method, node, topic, api) == int(was_there)
        if was_there:
            del self.registered[role, node, topic]
            if role == "s":
                del self.heard[node, topic]
        self.forget_the_gone()

    @rule(
        node=NODES, api=APIS, service=st.sampled_from(["/v", "/w"]),
        at=st.sampled_from(["rosrpc://1", "rosrpc://2"]),
    )  # fmt: skip
    def serve(self, node: str, api: str, service: str, at: str) -> None:
        is_leaving = self.is_leaving(node, api)
        assert self.call("registerService", node, service, at, api) == 1
        if is_leaving:
            return
        self.move(node, api)
        self.services[service] = (node, at)
        self.forget_the_gone()

    @rule(node=NODES, service=st.sampled_from(["/v", "/w"]), at=st.sampled_from(["rosrpc://1", "rosrpc://2"]))
    def stop_serving(self, node: str, service: str, at: str) -> None:
        was_there = self.services.get(service) == (node, at)
        assert self.call("unregisterService", node, service, at) == int(was_there)
        if was_there:
            del self.services[service]
        self.forget_the_gone()

    def forget_the_gone(self) -> None:
        there = {node for _, node, _ in self.registered} | {node for node, _ in self.services.values()}
        self.apis = {node: api for node, api in self.apis.items() if node in there}

    @invariant()
    def the_graph_is_that_of_the_model(self) -> None:
        publishers, subscribers, services = self.call("getSystemState", "/x")
        for role, table in (("p", publishers), ("s", subscribers)):
            flat = {(role, node, topic) for topic, nodes in table for node in nodes}
            assert flat == {key for key in self.registered if key[0] == role}
        assert dict(services) == {name: [node] for name, (node, _) in self.services.items()}
        for node in ("/a", "/b", "/c"):
            assert self.call("lookupNode", "/x", node) == self.apis.get(node)

    @invariant()
    def every_subscriber_knows_exactly_the_present_publishers(self) -> None:
        for role, node, topic in self.registered:
            if role == "s":
                present = {
                    self.apis[name] for kind, name, key in self.registered if (kind, key) == ("p", topic)
                }
                assert set(self.heard[node, topic]) == present

    # ---- parameters

    def clear(self, path: tuple[str, ...]) -> None:
        for known in [*self.leaves]:
            if known[: len(path)] == path:
                del self.leaves[known]
        self.namespaces = {known for known in self.namespaces if known[: len(path)] != path}

    def put(self, path: tuple[str, ...], value: Any) -> None:
        if isinstance(value, dict):
            self.namespaces.add(path)
            for key, item in value.items():
                self.put((*path, key), item)
        else:
            self.leaves[path] = value

    @rule(key=KEYS, value=VALUES)
    def set_param(self, key: str, value: Any) -> None:
        self.call("setParam", "/x", key, value)
        path = tuple(key.split("/")[1:])
        self.clear(path)
        for length in range(1, len(path)):
            self.leaves.pop(path[:length], None)
            self.namespaces.add(path[:length])
        self.put(path, value)

    @rule(key=KEYS)
    def delete_param(self, key: str) -> None:
        path = tuple(key.split("/")[1:])
        was_there = path in self.leaves or path in self.namespaces
        assert (self.call("deleteParam", "/x", key) is not None) == was_there
        self.clear(path)

    @invariant()
    def the_parameters_are_those_of_the_model(self) -> None:
        assert set(self.call("getParamNames", "/x")) == {"/" + "/".join(path) for path in self.leaves}
        for path, value in self.leaves.items():
            assert self.call("getParam", "/x", "/" + "/".join(path)) == value
        for path in self.namespaces:
            assert isinstance(self.call("getParam", "/x", "/" + "/".join(path)), dict)


TestMasterAgainstItsModel = MasterMachine.TestCase


TestMasterAgainstItsModel.settings = settings(
    max_examples=examples(60), stateful_step_count=40, deadline=None
)
