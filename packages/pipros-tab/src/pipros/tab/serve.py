"""Serves the page's folder with the headers that browsers require for shared memory, as in a classroom."""

from __future__ import annotations

import functools
import sys
import threading
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

from pipros.basics.interruptible_wait import ProgramLife, run_until_signalled
from pipros.server.tls import ServerFailed, tls_context

SILENT_S: Final = 30.0
"""A connection without a request for so long is closed."""

_HEADERS: Final = {
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
    "X-Content-Type-Options": "nosniff",
}


class _Files(SimpleHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    timeout = SILENT_S
    extensions_map = {  # noqa: RUF012 # as in the base class
        **SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
        ".mjs": "text/javascript",
        ".wasm": "application/wasm",
    }

    def end_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        super().end_headers()

    def list_directory(self, path: Any) -> None:  # noqa: ARG002
        """Refuse to list a folder."""
        self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


class _Server(ThreadingHTTPServer):
    def handle_error(self, *_: object) -> None:
        """Print nothing: browsers close connections at any time."""


def serve_folder(folder: str, host: str, port: int, certificate: str | None, key: str | None) -> int:
    """Serve a folder that `script/pyodide_files.py FOLDER --tab` has written, until Ctrl-C or SIGTERM.

    Raises:
        ServerFailed: the folder is another one, the port is in use, or the certificate cannot be read.
    """
    if not Path(folder, "files", "pipros.whl").is_file():
        raise ServerFailed(
            f"{folder} lacks files/pipros.whl: write it with script/pyodide_files.py FOLDER --tab"
        )
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
