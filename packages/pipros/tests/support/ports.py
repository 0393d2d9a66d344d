"""Free ports for masters. Each port is claimed by one test of this user at a time.

Tests of several users share the ports, but a port that is in use is not claimed.
"""

import os
import random
import socket
import tempfile
from pathlib import Path

from pipros.basics.posix import user_id
from tests.support.locks import lock

# Below the range that Linux and macOS use for port 0, so that no node's socket gets a port after the port was
# chosen here and before a master binds it.
_PORTS = range(20_000, 30_000)
_CLAIMS = Path(tempfile.gettempdir()) / f"pipros-test-ports-{user_id()}"


class ClaimedPort:
    """A port that no other test claims until `release`. A killed test frees it, too."""

    def __init__(self) -> None:
        _CLAIMS.mkdir(mode=0o777, exist_ok=True)
        for port in random.sample(_PORTS, len(_PORTS)):
            claim = os.open(_CLAIMS / str(port), os.O_CREAT | os.O_RDWR, 0o666)
            if lock(claim, waits=False) and _is_free(port):
                self.number = port
                self._claim = claim
                return
            os.close(claim)
        raise RuntimeError("no free port left for a test")

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.number}/"

    def release(self) -> None:
        os.close(self._claim)


def _is_free(port: int) -> bool:
    with socket.socket() as candidate:
        candidate.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            candidate.bind(("", port))
        except OSError:
            return False
    return True
