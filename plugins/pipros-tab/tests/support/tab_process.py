"""Runs a program as a worker of a browser tab does: `python -m tests.support.tab_process SOCKET PROGRAM`."""

import json
import os
import signal
import socket
import sys

from pipros_tab.command_run import INTERRUPTED
from pipros_tab.program import run_with
from tests.support.tab_hub import SocketPort

if __name__ == "__main__":
    port = SocketPort(socket.socket(fileno=int(sys.argv[1])))
    code = run_with(port, json.loads(sys.argv[2]))
    if code == INTERRUPTED:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    os._exit(code)
