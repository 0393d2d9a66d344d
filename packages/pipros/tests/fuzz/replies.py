"""Any bytes of a service server are a header and replies, or raise the documented errors.

An input is all that the server sends on one connection.

python -m tests.fuzz.replies --seconds 60
"""

import socket
import sys
import threading
from contextlib import suppress

from std_msgs.msg import Empty

from pipros.basics.limits import Limits
from pipros.node.service_link import CallTimeout, ServiceFailed, ServiceLink
from pipros.wire.handshake import WireType
from tests.fuzz import mutation
from tests.support.constants import changed
from tests.support.memory import memory_of

WORDS = [
    *(
        b"\x01", b"\0", b"\x05\0\0\0hello", b"\xff\xff\xff\xff", b"\xff\xff\xff\x3f", b"callerid=/x",
        b"error=no",
    ),
    *(
        b"md5sum=*", b"type=std_srvs/Empty", b"\x0a\0\0\0", b"request_type=", b"persistent=1", b"=",
        b"\x1b[31m",
    ),
]  # fmt: skip
LIMITS = Limits(frame_bytes=1_000_000_000)
MEMORY_BYTES = 6 << 20
"""A client asks the system for 4 MiB at most of what was announced."""

MEMORY_PER_BYTE = 10


class Server:
    """Send the same bytes to each client, and close when the client does."""

    def __init__(self) -> None:
        self.reply = b""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.uri = f"rosrpc://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client, suppress(OSError):
                client.sendall(self.reply)
                client.shutdown(socket.SHUT_WR)
                while client.recv(65536):
                    pass

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()


class Replies:
    """The target; `close` ends its server."""

    def __init__(self) -> None:
        self._server = Server()

    @changed(HEADER_BYTES=10_000, HANDSHAKE_S=5.0)
    def __call__(self, data: bytes) -> None:
        self._server.reply = data
        with memory_of(MEMORY_BYTES + MEMORY_PER_BYTE * len(data)):
            self._call_twice()

    def _call_twice(self) -> None:
        link = None
        try:
            link = ServiceLink(
                self._server.uri, "/service", "/fuzz", WireType("*", "*"), deadline=None, persistent=True,
                limits=LIMITS,
            )  # fmt: skip
            for _ in range(2):
                assert isinstance(link.call("/service", Empty(), None), bytes)
        except (ServiceFailed, CallTimeout):
            pass
        finally:
            if link is not None:
                link.close()

    def close(self) -> None:
        self._server.close()


if __name__ == "__main__":
    sys.exit(mutation.main(Replies(), "replies", WORDS, longer=(20_000,)))
