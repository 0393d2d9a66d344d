"""Run code in a Python without the modules and names that Windows or a browser lacks.

`tests.support.lacks` takes away what Windows lacks, or for a browser, what macOS lacks. `_BROWSER` replaces
functions that exist in Pyodide, which is Python in a browser, but do not work; `tests.pyodide` runs the same
programs there.
"""

import os
import subprocess
import sys

from tests.support import lacks
from tests.support.environments import ROOTS

PACKAGES = sorted(file.parent.name for root in ROOTS for file in root.glob("*/__init__.py"))
"""The packages of pipros."""

_BROWSER = """
import _thread, concurrent.futures, multiprocessing, os, socket, subprocess, sys, threading

def refused(*_, **__):
    raise RuntimeError("a browser starts no threads or processes, and connects no sockets")

sys.platform = "emscripten"
os.getuid = lambda: 0  # Pyodide has this function, but not geteuid
for place, names in {
    _thread: "start_new_thread start_joinable_thread",
    threading: "_start_new_thread _start_joinable_thread",
    threading.Thread: "start",
    subprocess.Popen: "__init__",
    multiprocessing.Process: "start",
    os: "system popen posix_spawnp",
    socket.socket: "bind connect connect_ex listen",
    socket: "create_connection create_server socketpair",
}.items():
    for name in names.split():
        if hasattr(place, name):
            setattr(place, name, refused)
"""


def run_without_posix(code: str, *, in_browser: bool = False) -> str:
    """Run code in a separate process, and return its output.

    Args:
        in_browser: whether threads, processes and connections also fail, as in Pyodide.

    Raises:
        AssertionError: the code failed. The message contains its standard error.
    """
    ended = subprocess.run(
        [sys.executable, "-c", f"{_BROWSER if in_browser else ''}\n{code}"],
        env={**os.environ, **lacks.environment("macos" if in_browser else "windows")}, capture_output=True,
        text=True, timeout=120,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return ended.stdout
