"""The server of the tab's page, and computers that open many connections or send too much."""

import functools
import gzip
import http.client
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_tab import serve
from tests.support.waiting import wait_until

CONNECTIONS = 8


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    (tmp_path / "index.html").write_text("the page")
    (tmp_path / "python.wasm").write_bytes(b"whole")
    (tmp_path / "python.wasm.gz").write_bytes(gzip.compress(b"packed"))
    monkeypatch.setattr(serve, "connections_that_fit", lambda _share: CONNECTIONS)
    server = serve._Server(("127.0.0.1", 0), functools.partial(serve._Files, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    yield server.server_port
    server.shutdown()
    server.server_close()


def page_of(connection: http.client.HTTPConnection) -> bytes:
    connection.request("GET", "/")
    return connection.getresponse().read()


def is_closed(connection: socket.socket) -> bool:
    """Return whether the server has closed a connection to which it sends nothing."""
    connection.settimeout(0.01)
    try:
        return connection.recv(1) == b""
    except TimeoutError:
        return False
    except ConnectionError:
        return True


def test_incomplete_requests_make_room_for_others(port: int) -> None:
    silent = [socket.create_connection(("127.0.0.1", port), 10) for _ in range(CONNECTIONS)]
    good = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    assert page_of(good) == b"the page"
    for each in silent:
        each.sendall(b"GET / HTTP/1.1\r\nX: ")
    more = [socket.create_connection(("127.0.0.1", port), 10) for _ in range(CONNECTIONS - 1)]
    wait_until(lambda: all(map(is_closed, silent)))
    assert page_of(good) == b"the page"  # on the same connection, whose request is newer than theirs
    for each in (good, *silent, *more):
        each.close()


def test_a_request_that_does_not_end_is_not_kept(port: int) -> None:
    with socket.create_connection(("127.0.0.1", port), 10) as client:
        client.sendall(b"GET / HTTP/1.1\r\n")
        for number in range(2 * serve.REQUEST_BYTES // 1000):
            try:
                client.sendall(b"X%d: %s\r\n" % (number, b"x" * 1000))
            except ConnectionError:
                break
        wait_until(lambda: is_closed(client))


@pytest.mark.parametrize(("accepted", "sent"), [({"Accept-Encoding": "gzip, br"}, b"packed"), ({}, b"whole")])
def test_a_compressed_file_is_sent_to_browsers_that_accept_it(
    port: int, accepted: dict[str, str], sent: bytes
) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", "/python.wasm", headers=accepted)
    answer = connection.getresponse()
    content = answer.read()
    assert (gzip.decompress(content) if answer.headers["Content-Encoding"] == "gzip" else content) == sent
    assert (answer.headers["Content-Type"], page_of(connection)) == ("application/wasm", b"the page")
    connection.close()
