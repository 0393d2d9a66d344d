"""Requests between programs of one user: neither side can hold the other by sending slowly."""

import contextlib
import os
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.net import local_requests, local_socket, local_stream
from pipros.net.local_requests import LocalFailed, LocalServer, ask

pytestmark = pytest.mark.needs("Unix sockets")
KIND = "tested"


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LocalServer]:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setattr(local_requests, "_TIMEOUT_S", 0.4)
    server = LocalServer(KIND, lambda request: {"is": request})
    yield server
    server.stop()


def trickle(connection: socket.socket, ended: threading.Event) -> None:
    with contextlib.suppress(OSError):
        while not ended.wait(0.05):
            connection.sendall(b" ")


def test_an_answer_that_trickles_in_has_a_deadline(server: LocalServer) -> None:
    listening = local_socket.listen(local_requests._folder(KIND), "1")
    ended = threading.Event()

    def serve() -> None:
        with listening.accept()[0] as connection:
            trickle(connection, ended)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        with pytest.raises(LocalFailed, match="process 1 does not answer: timed out"):
            ask(KIND, "1", {}, 1000)
    finally:
        ended.set()
        thread.join()
        listening.close()


def test_a_request_that_trickles_in_does_not_keep_others_waiting(server: LocalServer) -> None:
    server.start()
    ended = threading.Event()
    with local_socket.connect(local_requests._folder(KIND), str(os.getpid()), 5) as slow:
        thread = threading.Thread(target=trickle, args=(slow, ended))
        thread.start()
        try:
            for _ in range(3):  # each attempt waits as long as the server does for the slow client
                with contextlib.suppress(LocalFailed):
                    assert ask(KIND, str(os.getpid()), 5, 1000) == {"is": 5}
                    break
            else:
                pytest.fail("no answer")
        finally:
            ended.set()
            thread.join()


def test_a_publisher_cannot_have_a_subscriber_connect_to_another_program() -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as display:
        name = f"tested-display-{os.getpid()}"
        display.bind(f"\0{name}")
        display.listen(1)
        display.settimeout(0)
        for given in (name, "pipros-", "pipros-/display", ""):
            with pytest.raises(PermissionError, match="does not belong to a node"):
                local_stream.connect(given)
        with pytest.raises(BlockingIOError):
            display.accept()
