"""Clients of nodes with kept connections."""

from __future__ import annotations

from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

from pipros.wire.xmlrpc import decode_call, encode_response
from pipros_tools.graph.node_clients import NodeClients

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
