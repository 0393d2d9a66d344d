"""Run code in a Python without the modules and names that Windows, macOS or a browser lacks.

Each module and name in the lists is missing on at least one of these systems. Pyodide, which is Python in a
browser, also lacks the modules. `_BROWSER` replaces functions that exist in Pyodide, but do not work.
"""

from __future__ import annotations

import subprocess
import sys

from tests.support.environments import ROOTS

PACKAGES = sorted(file.parent.name for root in ROOTS for file in root.glob("*/__init__.py"))
"""The packages of pipros. Only their imports fail, because Python's library needs the modules on Linux."""

_BEGINNING = """
import asyncio, builtins, bz2, concurrent.futures, logging.handlers, multiprocessing, optparse, os, pathlib
import platform, random, secrets, select, selectors, shutil, signal, socket, socketserver, sqlite3
import ssl, subprocess, sys, tarfile, tempfile, threading, uuid, webbrowser
import xml.dom.minidom, xml.sax, yaml, zipfile

try:
    import numpy
except ImportError:
    pass

MODULES = {
    "_multiprocessing", "_posixsubprocess", "curses", "fcntl", "grp", "posix", "pty", "pwd", "readline",
    "resource", "syslog", "termios", "tty",
}
NAMES = {
    os: "chown fork forkpty geteuid getgid getloadavg getpgid getuid initgroups killpg mkfifo openpty "
    "posix_spawn register_at_fork sched_getaffinity setgid setpgid setpgrp setsid setuid sysconf uname "
    "wait4 waitid WNOHANG WIFEXITED WIFSIGNALED O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK",
    signal: "SIGKILL SIGHUP SIGUSR1 SIGUSR2 SIGCHLD SIGALRM SIGPIPE SIGQUIT SIGSTOP SIGCONT SIGTSTP alarm "
    "pthread_kill pthread_sigmask setitimer siginterrupt sigwait",
    socket: "AF_NETLINK AF_PACKET SCM_RIGHTS SO_REUSEPORT SO_BINDTODEVICE TCP_QUICKACK "
    "TCP_USER_TIMEOUT TCP_DEFER_ACCEPT MSG_DONTWAIT MSG_NOSIGNAL send_fds recv_fds sethostname",
    select: "epoll poll kqueue",
}
for module, names in NAMES.items():
    for name in names.split():
        vars(module).pop(name, None)
python_import = builtins.__import__

def import_without_posix(name, globals=None, locals=None, fromlist=(), level=0):
    importer = str((globals or {}).get("__name__", ""))
    if importer.partition(".")[0] in OURS and not level and name.partition(".")[0] in MODULES:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return python_import(name, globals, locals, fromlist, level)

builtins.__import__ = import_without_posix
for line in ("import fcntl", "from termios import tcgetattr", "from os import fork", "signal.SIGKILL"):
    try:
        exec(line, {"__name__": "pipros.probe", "signal": signal})
    except (ImportError, AttributeError):
        continue
    raise SystemExit(f"[{line}] works, and nothing below would prove anything")
"""

_BROWSER = """
import _thread

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
    code = f"OURS = {set(PACKAGES)!r}\n{_BEGINNING}\n{_BROWSER if in_browser else ''}\n{code}"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout
