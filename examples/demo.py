"""Starts the case study with `roslaunch --screen`. script/demo and windows_here.py call it."""

from __future__ import annotations

import argparse
import contextlib
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path
from xmlrpc.client import ServerProxy

from pipros.basics.env import DEFAULT_MASTER_URI, InvalidEnvironment, split_master_uri
from pipros.basics.interrupts import interrupt_main_thread
from pipros.basics.posix import NEW_GROUP
from pipros.basics.windows import ON_WINDOWS
from pipros_tools.cli import roslaunch

_REPOSITORY = Path(__file__).resolve().parents[1]
_EXAMPLES = _REPOSITORY / "examples" / "catkin_ws" / "src"
_ASK_TIMEOUT_S = 2.0
_ACTIVATE, _SET = (r".venv\Scripts\activate", "set") if ON_WINDOWS else (". .venv/bin/activate", "export")


def main() -> int:
    parser = argparse.ArgumentParser(prog="script/demo", description="Runs the case study until Ctrl-C.")
    parser.add_argument("--seconds", type=float, metavar="N", help="end after N seconds, with exit code 0")
    seconds: float | None = parser.parse_args().seconds

    uri = os.environ.get("ROS_MASTER_URI") or DEFAULT_MASTER_URI
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a pipe on Windows may lack letters of the folder
    try:
        print(_describe(uri, *split_master_uri(uri)), flush=True)
    except (InvalidEnvironment, _PortTaken) as error:
        print(f"script/demo: {error}", file=sys.stderr)
        return 1

    others = os.environ.get("ROS_PACKAGE_PATH")
    os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(filter(None, [str(_EXAMPLES), others]))
    if seconds is not None:
        end = threading.Timer(seconds, interrupt_main_thread)
        end.daemon = True
        end.start()
    with _page():
        return roslaunch.main(["--screen", "composiv_tryouts", "composiv_tryout.launch"])


@contextlib.contextmanager
def _page() -> Iterator[None]:
    """Run `rqt_graph` while the demo runs. It prints its address, and ends with the demo."""
    page = subprocess.Popen(  # noqa: S603 - this Python, and a text of this file
        [sys.executable, "-c", _PAGE],
        stdin=subprocess.PIPE,
        start_new_session=True,  # only the launch should get Ctrl-C, so that the page ends after the nodes
        creationflags=NEW_GROUP,
    )
    try:
        yield
    finally:
        page.communicate()


# This program ends when its standard input is closed, and so with the demo, however the demo ends.
_PAGE = """
import os, signal, sys, threading
def end():
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)
threading.Thread(target=end, daemon=True).start()
from pipros_page.commands.rqt_graph import main
main()
"""


class _PortTaken(Exception):
    pass


def _describe(uri: str, host: str, port: int) -> str:
    """Return the line that describes the demo and how to inspect it.

    Raises:
        _PortTaken: a program other than a ROS master listens at the master's address.
    """
    command = "rostopic echo /battery_topic"
    if uri != DEFAULT_MASTER_URI:
        command = f"{_SET} ROS_MASTER_URI={uri}{'' if ON_WINDOWS else ' '}&& {command}"
    line = (
        "A talker publishes a battery level and a listener shows it; Ctrl-C ends both. "
        f"To look from a second terminal, in {_REPOSITORY}: {_ACTIVATE} && {command}"
    )
    try:
        socket.create_connection((host, port), _ASK_TIMEOUT_S).close()
    except OSError:
        return line
    if not _is_master(uri):
        raise _PortTaken(
            f"port {port} is in use by a program that is not a ROS master. End that program, or take another "
            f"port: ROS_MASTER_URI=http://localhost:{port + 1} script/demo"
        )
    return f"{line}\nA ROS master already runs at {uri}: the demo joins it, and leaves it running."


def _is_master(uri: str) -> bool:
    socket.setdefaulttimeout(_ASK_TIMEOUT_S)
    try:
        with ServerProxy(uri) as master:
            answer = master.getPid("/demo")
    except Exception:
        return False
    finally:
        socket.setdefaulttimeout(None)
    return isinstance(answer, list) and len(answer) == 3


if __name__ == "__main__":
    sys.exit(main())
