"""Queries of nodes that may not answer."""

import math
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

import pytest

from pipros.wire.xmlrpc import decode_call, encode_response
from pipros_tools.graph.bus_info import (
    BusConnection,
    established,
    read_row,
    rows_of,
    sent_counts,
    statistics_of,
)
from pipros_tools.graph.node_clients import NodeClients
from pipros_tools.graph.node_queries import NodeQueries


def test_a_node_that_does_not_answer_delays_only_its_own_key() -> None:
    queries, ended = NodeQueries("test"), threading.Event()
    queries.ask("silent", lambda: ended.wait(60) and "late")
    queries.ask("quick", lambda: "answer")
    while queries.answer("quick") is None:
        queries.wait(0.01)

    assert queries.answer("quick") == "answer"
    assert queries.answer("silent") is None
    assert not queries.wait(0.01)
    ended.set()
    assert queries.wait(60)
    assert queries.answer("silent") == "late"
    queries.close()


def test_answers_are_requested_again_when_they_are_old_and_kept_if_there_is_none() -> None:
    answers = iter(["first", None, "third"])
    queries = NodeQueries("test", retry_s=0.0)
    seen = []
    for _ in range(3):
        queries.ask("key", lambda: next(answers))
        assert queries.wait(60)
        seen.append(queries.answer("key"))
    assert seen == ["first", "first", "third"]
    queries.forget_all_but([].__contains__)
    assert queries.answer("key") is None


def test_recent_answers_are_not_requested_again() -> None:
    queries, asked = NodeQueries("test", retry_s=1000.0), list[int]()
    for number in range(3):
        queries.ask("key", lambda number=number: asked.append(number))
        assert queries.wait(60)
    assert asked == [0]


def test_a_query_that_fails_is_logged_unless_the_queries_are_closed(caplog: pytest.LogCaptureFixture) -> None:
    queries = NodeQueries("test", retry_s=0.0)

    def fail() -> None:
        raise ValueError("broken")

    queries.ask("key", fail)
    assert queries.wait(60)
    queries.close()
    queries.ask("key", fail)
    assert queries.wait(60)

    assert [record.getMessage() for record in caplog.records] == ["a query to a node failed: key"]
    assert queries.answer("key") is None


# Clients of nodes with kept connections.


PEERS: list[tuple[str, int]] = []


class Answering(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_POST(self) -> None:
        PEERS.append(self.client_address)
        decode_call(self.rfile.read(int(self.headers["Content-Length"])))
        body = encode_response([1, "", 7])
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


def test_calls_share_a_connection_until_the_node_is_gone() -> None:
    PEERS.clear()
    with ThreadingHTTPServer(("127.0.0.1", 0), Answering) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        uri = f"http://127.0.0.1:{server.server_port}/"
        clients = NodeClients(10.0)
        for round_of_calls in range(2):
            for _ in range(3):
                with clients.client(uri) as api:
                    assert api.call("getPid", "/me") == [1, "", 7]
            assert len(set(PEERS)) == round_of_calls + 1
            clients.keep_only([])
        server.shutdown()


# Responses of nodes about their connections, well-formed and malformed.


def test_a_row_is_read_with_and_without_the_values_that_old_clients_omit() -> None:
    row: list[Any] = [1, "/listener", "o", "TCPROS", "/chatter"]
    assert read_row(row) == BusConnection("/listener", "o", "/chatter", id="1")
    assert read_row([*row, 0, "port 7"]) == BusConnection(
        "/listener", "o", "/chatter", id="1", is_established=False, remark="port 7"
    )


@pytest.mark.parametrize("row", [
    None, [], "row", [1, "/x", "o", "TCPROS"], [1, ["/x"], "o", "TCPROS", "/t"], [1, "/x", "o", "", 5]
])  # fmt: skip
def test_a_malformed_row_is_not_a_connection(row: object) -> None:
    assert read_row(row) is None
    assert list(established([row, [1, "/x", "o", "TCPROS", "/t"]])) == [BusConnection("/x", "o", "/t", "1")]


def test_connections_that_are_not_established_are_left_out() -> None:
    rows = [[1, "/x", "o", "TCPROS", "/t", state] for state in (False, 0, True, 1)]
    assert (len(list(established(rows))), list(established("rows"))) == (2, [])


@pytest.mark.parametrize("answer", [None, [], [0, "no", []], [1, "", "x"], [1, "", []] * 2])
def test_an_unexpected_response_is_an_error_that_names_the_method(answer: Any) -> None:
    with pytest.raises(ValueError, match=r"getBusInfo must return \[1, text, list\], got"):
        rows_of(answer, "getBusInfo")


def test_malformed_counts_are_ignored() -> None:
    statistics = [[["/t", 0, [[1, 10, 2], [2, "x", 3], None]], None, [], ["/u", 0, None]], 5]
    assert (dict(sent_counts(statistics)), dict(sent_counts([]))) == ({"1": (2, 10)}, {})


@pytest.mark.parametrize("number", [math.inf, -math.inf, math.nan, -1, 2**63, 2.0**70, True])
def test_impossible_counts_are_ignored(number: float) -> None:
    statistics = [[["/t", 0, [[1, 10, number], [2, number, 10], [3, 10, 10]]]]]
    assert [link for link, _ in sent_counts(statistics)] == ["3"]


def test_the_statistics_of_roscpp_are_read() -> None:
    """The response of a roscpp node: without code and text, and with another number for each connection."""
    answer = [[["/rosout", [[0, 194, 190, 1, 0]]], ["/battery_topic", [[1, 7888, 7780, 666, 0]]]], []]
    assert dict(sent_counts(statistics_of(answer))) == {"0": (1, 194), "1": (666, 7888)}


@pytest.mark.parametrize("answer", [[5], [["/t"], 5], 7, [], [1, "", 5], [0, "no", []]])
def test_malformed_statistics_are_an_error(answer: Any) -> None:
    with pytest.raises(ValueError, match="getBusStats must return"):
        statistics_of(answer)
