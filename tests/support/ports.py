"""Free ports for masters, each claimed by one test at a time, even among several users."""

from __future__ import annotations

import fcntl
import os
import random
import socket
import tempfile
from pathlib import Path

# Below the range that Linux and macOS use for port 0, so that no node's own socket gets a port
# between its choice here and a master's bind.
_PORTS = range(20_000, 30_000)
_CLAIMS = Path(tempfile.gettempdir()) / "pipros-test-ports"


class ClaimedPort:
    """Claim a port that no other test gets meanwhile. A file lock holds it, so a killed test frees it."""

    def __init__(self) -> None:
        _CLAIMS.mkdir(mode=0o777, exist_ok=True)
        for port in random.sample(_PORTS, len(_PORTS)):
            claim = os.open(_CLAIMS / str(port), os.O_CREAT | os.O_RDWR, 0o666)
            if _is_locked(claim) and _is_free(port):
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


def _is_locked(claim: int) -> bool:
    try:
        fcntl.flock(claim, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _is_free(port: int) -> bool:
    with socket.socket() as candidate:
        candidate.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            candidate.bind(("", port))
        except OSError:
            return False
    return True
