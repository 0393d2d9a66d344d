"""A simulated robot with its own master, which other plugins use for practice; see `Plugin.offers`."""

from __future__ import annotations

import functools
import os
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros_server.limited_process import LimitedProcess
from pipros_tools.graph.client import GraphClient

WORDS: Final = ("pipros_sim", "localized.launch", "headless:=true")
TOPIC: Final = "/odom"
"""Topic that is published once the robot can drive."""
LIMIT_S: Final = 86_400.0
START_S: Final = 60.0
ENDING_S: Final = 10.0


@contextmanager
def simulated_robot(environment: Environment) -> Iterator[tuple[Environment, Callable[[], None]]]:
    """Run a simulated robot within the context, for at most a day.

    Yield an environment with its master, and a function that returns when the robot can drive, and raises
    `PiprosError` if the simulation does not start.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    found = environment._replace(master_uri=f"http://localhost:{port}")
    code = "import sys; from pipros_tools.cli.roslaunch import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-I", "-c", code, "-p", str(port), *WORDS]
    process = LimitedProcess(command, LIMIT_S, found.applied_to(os.environ))
    try:
        print(
            f"The robot is simulated: export ROS_MASTER_URI={found.master_uri}", file=sys.stderr, flush=True
        )
        yield found, functools.cache(lambda: _wait_for(TOPIC, found, process))
    finally:
        process.stop(ENDING_S)


def _wait_for(topic: str, environment: Environment, process: LimitedProcess) -> None:
    """Wait until a topic is published. Raise `PiprosError` if the process ends first, or after `START_S`."""
    end_s = time.monotonic() + START_S
    while time.monotonic() < end_s and process.is_running:
        with suppress(PiprosError), GraphClient("practice", environment, timeout_s=1.0) as client:
            if topic in dict(client.master.get_system_state()[0]):
                return
        time.sleep(0.1)
    raise PiprosError(f"the simulation does not start: {process.output[-500:].strip()}")
