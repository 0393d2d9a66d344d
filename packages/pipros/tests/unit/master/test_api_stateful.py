"""Random calls to the master's API, compared with a simple model."""

from __future__ import annotations

from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from pipros.master.api import MasterApi
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from tests.support.examples import examples

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
        node=NODES,
        api=APIS,
        service=st.sampled_from(["/v", "/w"]),
        at=st.sampled_from(["rosrpc://1", "rosrpc://2"]),
    )
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
