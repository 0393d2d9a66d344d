"""Hundreds of valid and invalid calls of the Master and Parameter APIs, replayed against two masters.

`A`, `B`, `C` are placeholders for the APIs of listening nodes; everything else is sent unchanged.
"""

from __future__ import annotations

import itertools
import json
import random
import xmlrpc.client
from collections.abc import Iterator
from typing import Any

A, B, C = "<A>", "<B>", "<C>"
Call = tuple[str, tuple[Any, ...]]

ARITY = {
    **dict.fromkeys(["getPid", "getUri", "getTopicTypes", "getSystemState", "getParamNames"], 1),
    **dict.fromkeys(["lookupNode", "lookupService", "getPublishedTopics", "searchParam"], 2),
    **dict.fromkeys(["getParam", "hasParam", "deleteParam"], 2),
    **dict.fromkeys(["unregisterPublisher", "unregisterSubscriber", "unregisterService"], 3),
    **dict.fromkeys(["setParam", "subscribeParam", "unsubscribeParam"], 3),
    **dict.fromkeys(["registerPublisher", "registerSubscriber", "registerService"], 4),
}

ODD_NAMES = [
    "", "/", "//", "~", "a", "~a", "/a", "/a/", "//a//b", "a b", "/a:b", "/a-b", "/1", "/é", "a\tb", "~~a",
    "x~y",
]  # fmt: skip
ODD_TYPES = ["", "*", "**", "String", "std_msgs/String", "a/b/c", "/b", "a/", "a b/c", 5]
ODD_APIS = ["", "nope", "http:", "http://", "rosrpc://", "https://h:1", "HTTP://h:1", "foo://bar", 5]
CALLERS = ["", "/", "/n", "n", "~n", "/ns/n", "/ns/n/", "a b", 5, True, ["/n"]]


def calls() -> Iterator[Call]:
    yield from arity()
    yield from callers()
    yield from graph()
    yield from odd_registrations()
    yield from parameters()
    yield from searches()
    yield from written(NOTIFICATIONS)
    yield from multicalls()


def arity() -> Iterator[Call]:
    for method, right in ARITY.items():
        yield method, ()
        for count in (1, 2, 3, 4, 5, 6):
            if count != right:
                yield method, ("/n", *["/x/y"] * (count - 1))
        yield method, (5, *["/x"] * (right - 1))
    for unknown in (
        "nosuch", "system.listMethods", "system.methodHelp", "publisherUpdate", "getName", "__init__",
    ):  # fmt: skip
        yield unknown, ("/n",)


def callers() -> Iterator[Call]:
    for caller in CALLERS:
        yield "setParam", (caller, "p", 1)
        yield "setParam", (caller, "~q", 2)
        yield "getParam", (caller, "p")
        yield "hasParam", (caller, "~q")
        yield "searchParam", (caller, "p")
        yield "lookupNode", (caller, "x")
        yield "registerSubscriber", (caller, "t", "*", A)
        yield "registerService", (caller, "~s", "rosrpc://h:1", A)
        yield "lookupService", (caller, "~s")
        yield "unregisterService", (caller, "~s", "rosrpc://h:1")
        yield "unregisterSubscriber", (caller, "t", A)
    yield "getSystemState", ("/n",)
    yield "getParam", ("/n", "/")


def written(text: str) -> Iterator[Call]:
    """Yield the calls in a text: a method and its parameters a line, which are JSON or words."""
    for line in text.strip().splitlines():
        method, *words = line.split()
        yield method, tuple(json.loads(word) if word[0] in '0123456789{"' else word for word in words)


REGISTRATIONS = """
registerSubscriber /s /t * <A>
getTopicTypes /n
registerPublisher /p /t * <B>
getTopicTypes /n
registerSubscriber /s /t std_msgs/Bool <A>
registerPublisher /p /t std_msgs/String <B>
registerPublisher /p /t * <B>
getTopicTypes /n
registerPublisher /p /t std_msgs/String <B>
registerPublisher /p2 /t std_msgs/Int8 <C>
registerPublisher /p /ns/u std_msgs/Int8 <B>
registerSubscriber /p /t std_msgs/String <B>
registerService /p /srv rosrpc://h:1 <B>
registerService /p2 /srv rosrpc://h:2 <C>
registerService /p2 /srv rosrpc://h:3 <C>
getSystemState /n
getTopicTypes /n
"""
UNREGISTRATIONS = """
unregisterService /p /srv rosrpc://h:1
unregisterService /p /srv rosrpc://h:3
unregisterService /p2 /srv rosrpc://h:2
unregisterService /nobody /srv rosrpc://h:3
unregisterService /p2 /srv rosrpc://h:3
unregisterService /p2 /srv rosrpc://h:3
unregisterPublisher /p /t <C>
unregisterPublisher /p /nope <B>
unregisterPublisher /nobody /t <B>
unregisterPublisher /p /t <B>
unregisterPublisher /p /t <B>
unregisterSubscriber /p /t <C>
unregisterSubscriber /p /nope <B>
unregisterSubscriber /nobody /t <B>
unregisterSubscriber /p /t <B>
unregisterSubscriber /p /t <B>
unregisterPublisher /p2 /t <C>
lookupNode /n /p2
getSystemState /n
unregisterPublisher /p /ns/u <B>
unregisterSubscriber /s /t <A>
"""


def graph() -> Iterator[Call]:
    yield from written(REGISTRATIONS)
    for subgraph in ["", "/", "ns", "/ns", "/ns/", "/ns/u", "/t", "~", "/nope", 5, "a b"]:
        for caller in ("/n", "/ns/n", "/x/ns/n"):
            yield "getPublishedTopics", (caller, subgraph)
    for node, caller in itertools.product(["/p", "p", "/s", "/nope", "", "/", " ", 5], ["/n", "/ns/n"]):
        yield "lookupNode", (caller, node)
    for service, caller in itertools.product(["/srv", "srv", "/nope", "", "/", "a b", 5], ["/n", "/ns/n"]):
        yield "lookupService", (caller, service)
    yield from written(UNREGISTRATIONS)


def odd_registrations() -> Iterator[Call]:
    for name in [*ODD_NAMES, 5, True, ["/t"], {"a": 1}]:
        yield "registerPublisher", ("/ns/n", name, "a/B", A)
        yield "unregisterPublisher", ("/ns/n", name, A)
        yield "registerService", ("/ns/n", name, "rosrpc://h:1", A)
        yield "unregisterService", ("/ns/n", name, "rosrpc://h:1")
    for type_name in ODD_TYPES:
        yield "registerPublisher", ("/n", "/typed", type_name, A)
        yield "registerSubscriber", ("/n", "/typed", type_name, A)
    for api in ODD_APIS:
        yield "unregisterPublisher", ("/n", "/typed", api)
        yield "registerService", ("/n", "/srv", api, A)
        yield "unregisterService", ("/n", "/srv", api)
        yield "unsubscribeParam", ("/n", api, "/p")
    for api in ["", "nope", "http:", "https://h:1", 5]:
        yield "registerPublisher", ("/n", "/typed", "a/B", api)
        yield "registerSubscriber", ("/n", "/typed", "a/B", api)
        yield "subscribeParam", ("/n", api, "/p")
    yield "unregisterPublisher", ("/n", "/typed", A)
    yield "unregisterSubscriber", ("/n", "/typed", A)
    yield "getSystemState", ("/n",)


def parameters() -> Iterator[Call]:
    values: list[Any] = [
        *(0, -1, 2**31 - 1, -(2**31), 1.5, -0.0, 1e300, True, False, "", "text", "ü<&>\"'", " x ", "a\nb\tc"),
        *(
            [], {}, [1, "x", [2.5, {}]], {"a": {"b": {"c": []}}}, {"": 1}, {"x/y": {"z": 1}},
            {"~": {"c": 2}, "a b": 3},
        ),
        *(xmlrpc.client.Binary(b"\x00\xff"), xmlrpc.client.DateTime("20200101T00:00:00")),
    ]  # fmt: skip
    yield "setParam", ("/n", "/", {})
    for number, value in enumerate(values):
        yield "setParam", ("/n", f"/v/{number}", value)
        yield "getParam", ("/n", f"/v/{number}")
    yield "getParamNames", ("/n",)
    for value in values:
        yield "setParam", ("/n", "/same", value)
        yield "setParam", ("/n", "/same/below", value)
        yield "getParam", ("/n", "/same")
    yield "getParam", ("/n", "/")
    yield "setParam", ("/n", "/", {"a": {"b": 1, "c": {}}, "x/y": {"z": 3}})
    for key in [*ODD_NAMES, "/a/b", "/a/b/", "a/b", "/a/c", "/a/b/c", "/x/y", "/x/y/z", "/nope", 5, True]:
        for method in ("getParam", "hasParam"):
            yield method, ("/n", key)
    for key in [*ODD_NAMES, 5, "/a/new/deep"]:
        yield "setParam", ("/ns/n", key, 1)
    yield "getParamNames", ("/n",)
    yield "getParam", ("/n", "/")
    for key in [*ODD_NAMES, 5, "/a/b", "/nope", "/a/nope", "/a"]:
        yield "deleteParam", ("/ns/n", key)
    yield "getParam", ("/n", "/")


def searches() -> Iterator[Call]:
    tree = {"k": 3, "w": {"g": {"k": 1}}, "ns": {"w": {"q": 2}, "n": {"w": 3}}}
    yield "setParam", ("/n", "/", tree)
    keys = [
        "w", "k", "w/g/k", "w/g", "w/q", "/w/g", "/w/nope", "~w", "nope", "", "w/", "/", "q r", "n/w", "//w",
        5,
    ]  # fmt: skip
    for caller, key in itertools.product(["/ns/n", "/ns/", "/ns/m", "/", "/other/n", "ns", "", "~"], keys):
        yield "searchParam", (caller, key)


# Genuine rosmaster does not notify a subscriber below a namespace that became a value; ours does: /b leaves
# before. At the end, the same name at another address: the first node is shut down, and is forgotten.
NOTIFICATIONS = """
setParam /n / {}
subscribeParam /a <A> /w
subscribeParam /b <B> /w/g/
subscribeParam /c <C> /
setParam /n /w/g/k 1
setParam /n /w {"g":5,"h":{"i":1}}
setParam /n /w/g {"k":1,"l":{"m":2}}
setParam /n /w/g/l/m 3
setParam /b /w/g/own_change 3
setParam /n /w2 1
deleteParam /n /w/g
deleteParam /n /w
deleteParam /n /w
setParam /n / {"w":{"z":1}}
setParam /n /c/own 1
unsubscribeParam /nobody <A> /w
unsubscribeParam /a <B> /w
unsubscribeParam /a <A> /nope
unsubscribeParam /b <B> /w/g
setParam /n /w 1
unsubscribeParam /a <A> /w
setParam /n /w 2
registerSubscriber /a /t x/Y <A>
registerSubscriber /b /t x/Y <B>
registerPublisher /c /t x/Y <C>
registerPublisher /c /t x/Y <C>
registerPublisher /b /t x/Y <B>
unregisterPublisher /c /t <B>
unregisterSubscriber /a /t <A>
unregisterPublisher /c /t <C>
registerService /c /of_c rosrpc://c:1 <C>
registerSubscriber /c /t x/Y <A>
lookupNode /n /c
lookupService /n /of_c
setParam /n /unheard_by_c 1
getSystemState /n
"""


def multicalls() -> Iterator[Call]:
    def call(name: str, *params: Any) -> dict[str, Any]:
        return {"methodName": name, "params": list(params)}

    yield "system.multicall", ([],)
    yield (
        "system.multicall",
        (
            [
                call("setParam", "/n", "/multi", {"a": 1}), call("getParam", "/n", "/multi/a"),
                call("getParam", "/n", "/none"), call("getParam"), call("nosuch"),
                call("system.multicall", []), call("deleteParam", "/n", "/multi"),
            ],
        ),
    )  # fmt: skip


RANDOM_NODES = ("/a", "/b", "/ns/c", "/ns/d", "/x/", "/", "")
RANDOM_NAMES = (
    *("t", "/t", "/ns/t", "~t", "t/u", "/t/u/", "//t", "t//u", "/a/b/c/d", "/ns", "ns", "k", "/k/l", "k/l/m"),
    *(
        "", "/", "~", "~/x", "~~x", "/~x", "x~", "a/~b", "t t", "t:u", "-", "1", "/é/ü", "/t?", "<&>", "\t",
        "/../x",
    ),
)  # fmt: skip
RANDOM_TYPES = ("*", "x/Y", "a/B", "std_msgs/String", "x", "", "x/y/z", "/x", "x/")
RANDOM_VALUES = (
    *(
        0, -5, 2**31 - 1, 1.5, -0.0, 1e300, True, "", "s", "é<&>", "x" * 1000, [], [1, "a", [2.5]], {},
        {"": 1},
    ),
    *({"k": 1}, {"k": {"l": {"m": [1]}}}, {"t": {"u": 5}}, {" ": {"k": {}}}),
    *(xmlrpc.client.Binary(b"\x00\x01"), xmlrpc.client.DateTime("20200101T00:00:00")),
)  # fmt: skip
RANDOM_SERVICES = ("rosrpc://h:1", "rosrpc://h:2", "http://h:1", "x")


def random_calls(count: int, seed: int) -> Iterator[Call]:
    """Yield calls of unreachable nodes, each with one fixed API; some arguments are missing or wrong."""
    pick = random.Random(seed)  # noqa: S311  # no secret
    for _ in range(count):
        node, name, key = pick.choice(RANDOM_NODES), pick.choice(RANDOM_NAMES), pick.choice(RANDOM_NAMES)
        api = f"http://127.0.0.1:{1 + RANDOM_NODES.index(node)}/"
        type_name, service_api = pick.choice(RANDOM_TYPES), pick.choice(RANDOM_SERVICES)
        method, *params = pick.choice(
            [
                *[("setParam", key, pick.choice(RANDOM_VALUES))] * 3,
                *[("getParam", key), ("getParam", "/"), ("hasParam", key), ("deleteParam", key)],
                *[("searchParam", key), ("getParamNames",)],
                *[("subscribeParam", api, key), ("unsubscribeParam", api, key)],
                *[("registerPublisher", name, type_name, api), ("unregisterPublisher", name, api)],
                *[("registerSubscriber", name, type_name, api), ("unregisterSubscriber", name, api)],
                *[("registerService", name, service_api, api), ("unregisterService", name, service_api)],
                *[("lookupNode", name), ("lookupNode", pick.choice(RANDOM_NODES)), ("lookupService", name)],
                *[("getTopicTypes",), ("getPublishedTopics", name), ("getSystemState",)],
            ]
        )
        arguments = [node, *params]
        if pick.random() < 0.05:
            arguments[pick.randrange(len(arguments))] = pick.choice([0, 1, 1.5, [], {}, True, ""])
        elif pick.random() < 0.03:
            arguments.pop()
        yield method, tuple(arguments)
