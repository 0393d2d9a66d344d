"""Runs a program as a worker of a browser tab does: `python -m tests.support.tab_process SOCKET PROGRAM`."""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
from typing import Any, NoReturn

from pipros.tab.program import run_with
from tests.support.tab_hub import SocketPort


def refuse_threads() -> None:
    """Make every thread fail to start, as in Pyodide."""

    def refuse(*_: object, **__: object) -> NoReturn:
        raise RuntimeError("can't start new thread")

    replaced: Any = threading.Thread
    replaced.start = refuse


if __name__ == "__main__":
    port = SocketPort(socket.socket(fileno=int(sys.argv[1])))
    refuse_threads()
    code = run_with(port, json.loads(sys.argv[2]))
    os._exit(code)
