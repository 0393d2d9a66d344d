"""The Master and Parameter API: codes, texts and values, as genuine rosmaster answers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

from pipros.master.api import MasterApi
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry

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


@pytest.mark.parametrize(
    ("method", "error_value"),
    [
        ("getPid", -1),
        ("getUri", ""),
        ("getSystemState", [[], [], []]),
        ("registerPublisher", []),
        ("getParam", 0),
    ],
)
def test_wrong_calls_are_error_responses_not_faults(master: Case, method: str, error_value: Any) -> None:
    assert master.call(method) == [-1, "missing required caller_id parameter", error_value]
    assert master.call(method, 5) == [-1, "caller_id must be a string", error_value]
    assert master.call(method, "/n", *range(9)) == [-1, "Error: bad call arity", error_value]


@pytest.mark.parametrize(
    ("method", "before", "after"),
    [
        ("lookupNode", (), ()),
        ("registerPublisher", (), ("x/Y", API)),
        ("registerPublisher", ("/t",), (API,)),
        ("registerService", ("/s",), (API,)),
        ("registerService", ("/s", "rosrpc://h:1"), ()),
        ("setParam", (), (1,)),
        ("searchParam", (), ()),
        ("getPublishedTopics", (), ()),
    ],
)
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
        1,
        "Registered [/p] as publisher of [/t]",
        ["http://s:1/"],
    ]
    assert master.notices == [Notice("/s", "http://s:1/", "publisherUpdate", ("/master", "/t", [API]))]
    assert master.call("registerSubscriber", "/s2", "/t", "x/Y", "http://s:2/")[2] == [API]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
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
    ],
)
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
