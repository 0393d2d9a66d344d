"""`rqt_graph`: its server, messages, access control and pictures."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets import Origin
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.support.page import Page
from tests.support.ros import RosSystem

TALKER, LEVEL, LISTENER = (
    {"kind": "node", "name": "/talker"},
    {"kind": "topic", "name": "/level"},
    {"kind": "node", "name": "/listener"},
)
CHAIN = [(TALKER, LEVEL), (LEVEL, LISTENER)]


def start_chain(ros: RosSystem) -> RosSystem:
    """Start a master, and `/talker` that publishes `/level` to `/listener`."""
    ros.pipros.start_master()
    ros.pipros.start("rostopic", "pub", "-r", "20", "/level", "std_msgs/String", "'%25'", "__name:=talker")
    ros.pipros.start("rostopic", "echo", "/level", "__name:=listener").wait_for("%25")
    return ros


@pytest.fixture
def chain(ros: RosSystem) -> RosSystem:
    return start_chain(ros)


@pytest.fixture(scope="module")
def page(shared_ros: RosSystem) -> Page:
    """The page of a chain in which no test changes anything."""
    return Page(start_chain(shared_ros))


def first(values: Iterator[Any], condition: Callable[[Any], object]) -> Any:
    """Return the first value that meets a condition. The test's time limit ends the wait."""
    return next(value for value in values if condition(value))


def chain_in(value: Any) -> bool:
    arrows = value.get("scene", {}).get("arrows", ())
    return [(arrow["start"], arrow["end"]) for arrow in arrows] == CHAIN


def test_the_files_of_the_page_are_served_and_nothing_else(page: Page) -> None:
    first_page = page.get("/")
    assert first_page.status == 200
    assert "script-src 'self'" in first_page.headers["Content-Security-Policy"]
    assert first_page.headers["Set-Cookie"] is None
    assert page.token not in first_page.read().decode()
    assert page.get("/app.js").headers["Content-Type"] == "text/javascript; charset=utf-8"
    assert page.get("/tabs/graph.js").status == 200
    for path in ("/nothing", "/../__init__.py", "/tabs", "/%2e%2e/server.py", "/tabs/../app.js"):
        assert page.get(path).status == 404
    assert page.get("/", Host="evil.example").status == 403


def test_other_sites_cannot_connect(page: Page) -> None:
    for origin in ("http://evil.example", f"https://{page.host}", "null"):
        with pytest.raises(InvalidStatus) as refused, page.connect(origin):
            pass
        assert refused.value.response.status_code == 403


def test_a_proxy_that_adds_tls_says_so(page: Page) -> None:
    origin = Origin(f"https://{page.host}")
    for headers in ({}, {"X-Forwarded-Proto": "http"}):
        with (
            pytest.raises(InvalidStatus) as refused,
            connect(f"ws://{page.host}/live", origin=origin, additional_headers=headers, proxy=None),
        ):
            pass
        assert refused.value.response.status_code == 403
    proxied = {"X-Forwarded-Proto": "https"}
    with connect(f"ws://{page.host}/live", origin=origin, additional_headers=proxied, proxy=None) as socket:
        socket.send(json.dumps({"token": page.token}))
        assert json.loads(socket.recv(timeout=30))["data"] == {"token": page.token}


def test_roslaunch_shows_the_address_but_no_log_has_the_token(ros: RosSystem) -> None:
    ros.serve_master()
    launch = ros.home / "page.launch"
    node = '<node name="page" pkg="rqt_graph" type="rqt_graph" args="--no-browser"/>'
    launch.write_text(f"<launch>{node}</launch>")
    launched = ros.pipros.start("roslaunch", launch)
    page = Page.of(launched)
    assert page.get("/").status == 200
    launched.press_ctrl_c()
    assert launched.wait() == 0
    logs = [path for path in (ros.home / ".ros" / "log").rglob("*") if path.is_file()]
    assert any(path.name.startswith("page-1") for path in logs)
    assert [path for path in logs if page.token in path.read_text()] == []


def test_the_graph_is_sent_with_traffic_and_updated(chain: RosSystem) -> None:
    page = Page(chain)
    with page.connect() as browser:
        graph = browser.watch("graph")
        first(graph, chain_in)
        first(
            graph,
            lambda value: (rates := value.get("traffic")) and all(rate and rate[0] > 1 for rate in rates),
        )
        chain.pipros.start("rostopic", "echo", "/level", "__name:=another")
        first(graph, lambda value: len(value.get("scene", {}).get("arrows", ())) == 3)


def test_a_killed_node_is_shown_as_such(chain: RosSystem) -> None:
    other = chain.pipros.start(
        "rostopic", "pub", "-r", "20", "/level", "std_msgs/String", "x", "__name:=other"
    )
    page = Page(chain)
    with page.connect() as browser:
        graph = browser.watch("graph", mode="all", hide_debug=True)

        def other_is(reachable: bool, value: Any) -> bool:
            boxes = value.get("scene", {}).get("boxes", ())
            return any(box["name"] == "/other" and box["reachable"] is reachable for box in boxes)

        first(graph, lambda value: other_is(True, value))
        other.kill()
        gone = first(
            graph,
            lambda value: (
                other_is(False, value)
                or ("scene" in value and not any(box["name"] == "/other" for box in value["scene"]["boxes"]))
            ),
        )
        assert gone


def test_a_topic_is_subscribed_only_while_a_browser_shows_it(shared_ros: RosSystem, page: Page) -> None:
    def watchers() -> list[str]:
        return [node for node in shared_ros.subscribers("/level") if node.startswith("/rqt_graph")]

    with page.connect() as browser:
        first(browser.watch("graph"), chain_in)
        assert watchers() == []
        topic = first(browser.watch("topic", name="/level"), lambda value: "message" in value)
        assert (topic["message"], topic["gauge"]) == ({"data": "%25"}, 25.0)
        assert (topic["type"], topic["from"]) == ("std_msgs/String", "/talker")
        assert len(watchers()) == 1
    with page.connect() as browser:
        first(browser.watch("graph"), lambda _: not watchers())


def test_a_node_reports_its_connections(page: Page) -> None:
    with page.connect() as browser:
        node = first(browser.watch("node", name="/talker"), lambda value: value["connections"])
        assert ["/level", "std_msgs/String"] in node["publications"]
        assert ["/talker", "/level", "/listener"] in [row[:3] for row in node["connections"]]
        assert {row[5] for row in node["connections"]} <= {"TCPROS", "PIPROSLOCAL"}


def test_a_vanished_master_is_reported_and_found_again(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    page = Page(ros)
    with page.connect() as browser:
        graph = browser.watch("graph")
        first(graph, lambda value: value.get("error") == "")
        core.press_ctrl_c()
        core.wait()
        first(graph, lambda value: value.get("error"))
        ros.pipros.start_master()
        first(graph, lambda value: value.get("error") == "")


def test_invalid_requests_are_answered(page: Page) -> None:
    with page.connect() as browser:
        for arguments, error in (
            ({"mode": "sideways"}, "mode must be one of nodes, active, all, got 'sideways'"),
            ({"hide_tf": 1}, "hide_tf must be true or false, got 1"),
            ({"nodes": True}, "nodes must be a string, got True"),
            ({"hide_rosout": True}, "unknown option 'hide_rosout'; the options are mode, "),
            ({"nodes": "x" * 2000}, "at most 1000 characters"),
        ):
            assert error in next(browser.watch("graph", **arguments))["error"]
        assert "global name" in next(browser.watch("topic", name="level"))["error"]
        assert "unknown view" in next(browser.watch("nothing"))["error"]
        assert "unknown action" in browser.act("nothing")["error"]
        many = "[" + "{}," * 200_000 + "{}]"
        for text in ("{", "[]", '{"id": "x"}', '{"id": -1}', "[" * 10_000, many):
            browser.socket.send(text)
            assert "malformed request" in json.loads(browser.socket.recv(timeout=30))["error"]
        assert browser.act("about")["control"] is False


def test_pictures_are_written(shared_ros: RosSystem, page: Page) -> None:
    home: Path = shared_ros.home
    done = shared_ros.pipros.run("rqt_graph", "--dot", "--svg", "g.svg", "--png", "g.png")
    assert done.returncode == 0, done.output
    assert '  "node /talker" -> "topic /level";' in done.stdout
    assert "<ellipse" in (home / "g.svg").read_text()
    assert (home / "g.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["--svg="], 1, "cannot write : Is a directory"),
    (["--svg", "/dev/null/x.svg"], 1, "cannot write /dev/null/x.svg: Not a directory"),
    (["--mode", "round"], 2, "--mode must be nodes, active or all, got round"),
    (["--bind", "127.0.0.1:70000"], 1, "--bind must be HOST or HOST:PORT"),
    (["--bind", "192.0.2.1"], 1, "cannot listen at 192.0.2.1:0"),
    (["--cert", "/dev/null/x"], 1, "cannot use the certificate /dev/null/x"),
    (["left", "over"], 2, "unexpected argument: left"),
])  # fmt: skip
def test_invalid_arguments_are_refused(ros: RosSystem, arguments: list[str], code: int, words: str) -> None:
    ros.serve_master()
    done = ros.pipros.run("rqt_graph", "--no-browser", *arguments)
    assert done.returncode == code
    assert words in done.output


def test_a_picture_needs_a_master(ros: RosSystem) -> None:
    done = ros.pipros.run("rqt_graph", "--dot")
    assert done.returncode == 1
    assert "ERROR: Unable to communicate with master!" in done.output


def test_ctrl_c_ends_it(chain: RosSystem) -> None:
    page = Page(chain)
    with page.connect() as browser:
        first(browser.watch("topic", name="/level"), lambda value: "message" in value)
        page.process.press_ctrl_c()
        assert page.process.wait() == 0
