"""The server of the page of `rqt_graph`, and a client for its protocol."""

from __future__ import annotations

import contextlib
import http.client
import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets import Origin
from websockets.sync.client import ClientConnection, connect

from tests.support.processes import Process
from tests.support.ros import RosSystem

ADDRESS = r"http\S+#token=\S+"


class Page:
    """A running `rqt_graph`.

    Attributes:
        url: the address of the page, with the token, as the command printed it.
        place: the tab that the address opens.
    """

    def __init__(
        self,
        ros: RosSystem,
        *options: str | Path,
        command: str = "rqt_graph",
        prefix: Sequence[str] = (),
        **variables: str,
    ) -> None:
        """Start `command`, with additional environment `variables`. `prefix` is put before the command."""
        limits = variables.get("PIPROS_LIMITS") or ros.pipros.environment.get("PIPROS_LIMITS", "")
        if "login_s" not in limits:  # the test may be stopped for seconds before it logs in
            variables["PIPROS_LIMITS"] = ", ".join(filter(None, ("login_s=60", limits)))
        self._open(ros.pipros.start(*prefix, command, "--no-browser", *options, **variables))

    @classmethod
    def of(cls, process: Process) -> Page:
        """Return the page of a running program that prints its address."""
        page = cls.__new__(cls)
        page._open(process)
        return page

    @classmethod
    def at(cls, url: str) -> Page:
        """Return the page with an address that a program printed."""
        page = cls.__new__(cls)
        page._use(url)
        return page

    def _open(self, process: Process) -> None:
        self.process = process
        self._use(process.wait_for(ADDRESS, 60.0)[0])

    def _use(self, url: str) -> None:
        self.url = url
        parts = urlsplit(self.url)
        self.host = parts.netloc
        proof, _, self.place = parts.fragment.partition("/")
        self.token = proof.removeprefix("token=")

    def get(self, path: str, **headers: str) -> http.client.HTTPResponse:
        """Request a path with the given headers, such as `Host`, and return the response."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        connection.request("GET", path, headers=headers)
        return connection.getresponse()

    def url_of(self, place: str) -> str:
        """Return the address that opens the tab `place`."""
        return f"http://{self.host}/#token={self.token}/{place}"

    @contextlib.contextmanager
    def connect(self, origin: str | None = None, first: str | None = None) -> Iterator[LivePage]:
        """Connect like the page in a browser.

        Args:
            origin: the `Origin` header; defaults to the origin of the page.
            first: sent instead of the message with the token.
        """
        with connect(
            f"ws://{self.host}/live",
            origin=Origin(f"http://{self.host}" if origin is None else origin),
            proxy=None,
            open_timeout=30,
        ) as socket:
            socket.send(json.dumps({"token": self.token}) if first is None else first)
            yield LivePage(socket)


class LivePage:
    """A connection like that of a browser with the page, which watches views and calls actions."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self._numbers = itertools.count(1)

    def watch(self, view: str, **args: Any) -> Iterator[Any]:
        """Yield the updates of a view, without end. While one view is read, updates of others are lost."""
        number = next(self._numbers)
        self.socket.send(json.dumps({"id": number, "view": view, "args": args}))
        while True:
            yield self._answer(number)

    def act(self, action: str, **args: Any) -> Any:
        """Call an action, and return its result, or `{"error": text}` if it failed."""
        number = next(self._numbers)
        self.socket.send(json.dumps({"id": number, "action": action, "args": args}))
        return self._answer(number)

    def _answer(self, number: int) -> Any:
        while True:
            data = self._received(number)
            if isinstance(data, bytes):
                if int.from_bytes(data[:4], "big") == number:
                    return data[4:]
                continue
            message: Mapping[str, Any] = json.loads(data)
            if message["id"] in (number, -1):
                return message["data"] if "data" in message else {"error": message["error"]}

    def _received(self, number: int) -> str | bytes:
        """Return the next message, or the last of the parts of an answer as a whole."""
        parts = b""
        while True:
            data = self.socket.recv(timeout=30)
            if isinstance(data, str) or int.from_bytes(data[:4], "big") != number + 2**31:
                if not parts:
                    return data
                continue
            parts += data[5:]
            if data[4]:
                return parts.decode() if data[4] == 1 else parts
