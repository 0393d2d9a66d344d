"""Serves the page's folder with the headers that browsers require for shared memory, as in a classroom.

Instead of a file, `FILE.gz` is sent if there is one, and the browser accepts it.

Each connection has a thread. If there are too many connections, a new one replaces the one whose last request
is oldest, so that a computer that opens many, or reads slowly, does not shut out the others.
"""

from __future__ import annotations

import contextlib
import functools
import os
import socket
import sys
import threading
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

from pipros.basics.interruptible_wait import ProgramLife, run_until_signalled
from pipros.net.address import plain_address
from pipros.net.connection_table import ConnectionTable, LinkEntry
from pipros.net.refusals import Refusals
from pipros.net.sockets import connections_that_fit
from pipros_server.tls import ServerFailed, tls_context

SILENT_S: Final = 30.0
"""A connection without a request for so long is closed."""

REQUEST_BYTES: Final = 65_536
"""A connection with a larger request is closed."""
PACKED: Final = ".gz"
_SHARE: Final = 1 / 4
"""Share of the process's file descriptors that connections may use; each of them may also read a file."""
_BACKLOG: Final = 128

_HEADERS: Final = {
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
    "Vary": "Accept-Encoding",
    "X-Content-Type-Options": "nosniff",
}


class _Lines:
    """The lines of one request, of at most `REQUEST_BYTES`."""

    def __init__(self, file: Any) -> None:
        self._file, self._left = file, REQUEST_BYTES
        self.close = file.close

    def readline(self, size: int) -> bytes:
        line: bytes = self._file.readline(size)
        self._left -= len(line)
        if self._left < 0:
            raise ConnectionAbortedError("the request is too large")
        return line


class _Files(SimpleHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"
    timeout = SILENT_S
    extensions_map = {  # noqa: RUF012 # as in the base class
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".mjs": "text/javascript",
        ".wasm": "application/wasm",
    }

    _is_packed = False

    def setup(self) -> None:
        super().setup()
        self._input = self.rfile

    def handle_one_request(self) -> None:
        self.rfile: Any = _Lines(self._input)
        super().handle_one_request()

    def send_head(self) -> Any:
        self.server.mark_used(self.request)
        return super().send_head()

    def translate_path(self, path: str) -> str:
        file = super().translate_path(path)
        accepted = self.headers.get("Accept-Encoding", "")
        self._is_packed = "gzip" in accepted and os.path.isfile(f"{file}{PACKED}")
        return f"{file}{PACKED}" if self._is_packed else file

    def guess_type(self, path: Any) -> str:
        return super().guess_type(str(path).removesuffix(PACKED) if self._is_packed else path)

    def end_headers(self) -> None:
        if self._is_packed:
            self.send_header("Content-Encoding", "gzip")
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def list_directory(self, path: Any) -> None:  # noqa: ARG002
        """Refuse to list a folder."""
        self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


class _Server(ThreadingHTTPServer):
    request_queue_size = _BACKLOG

    def __init__(self, address: tuple[str, int], handler: Any) -> None:
        limit = connections_that_fit(_SHARE)
        self._table = ConnectionTable(
            limit=limit, limit_per_peer=limit // 2, refusals=Refusals(), spares_loopback=True
        )
        self._entries: dict[Any, LinkEntry] = {}
        super().__init__(address, handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        def end() -> None:
            with contextlib.suppress(OSError):
                socket.socket.shutdown(request, socket.SHUT_RDWR)  # its thread closes it

        entry = self._entries[request] = LinkEntry(plain_address(str(client_address[0])), end)
        self._table.add(entry)
        super().process_request(request, client_address)

    def mark_used(self, request: Any) -> None:
        """Make a connection the last candidate for closing."""
        self._table.mark_used(self._entries[request])

    def shutdown_request(self, request: Any) -> None:
        self._table.remove(self._entries.pop(request))
        super().shutdown_request(request)

    def handle_error(self, *_: object) -> None:
        """Print nothing: browsers close connections at any time."""


def serve_folder(folder: str, host: str, port: int, certificate: str | None, key: str | None) -> int:
    """Serve a folder that `script/generate tab FOLDER` has written, until Ctrl-C or SIGTERM.

    Raises:
        ServerFailed: the folder is another one, the port is in use, or the certificate cannot be read.
    """
    if not Path(folder, "files", "pipros.whl").is_file():
        raise ServerFailed(f"{folder} lacks files/pipros.whl: write it with script/generate tab FOLDER")
    tls = tls_context(certificate, key)
    try:
        server = _Server((host, port), functools.partial(_Files, directory=folder))
    except OSError as error:
        raise ServerFailed(f"cannot listen at {host}:{port}: {error.strerror or error}") from None
    if tls is not None:
        server.socket = tls.wrap_socket(server.socket, server_side=True, do_handshake_on_connect=False)
    scheme, shown = "https" if tls else "http", "localhost" if host == "127.0.0.1" else host
    print(f"pipros serve: {scheme}://{shown}:{server.server_port}/", file=sys.stderr, flush=True)
    if tls is None and shown != "localhost":
        print(
            "Browsers run the page of other computers only over TLS: use --cert and --key.", file=sys.stderr
        )

    def serve(life: ProgramLife) -> None:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        life.over.wait()
        server.shutdown()
        server.server_close()

    run_until_signalled(serve)
    return 0
