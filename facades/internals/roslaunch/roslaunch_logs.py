"""The command `roslaunch-logs`, which prints the folder of the current run's log files."""

from __future__ import annotations

import sys

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.net.master_client import MasterClient

_star_names(__name__, "os rosgraph rospkg time traceback")

NAME = "roslaunch-logs"


def get_run_id() -> str | None:
    """Return the master's run ID, or None if no master responds."""
    client = MasterClient(Environment.from_os().master_uri, "/roslaunch", timeout_s=5.0)
    try:
        return str(client.get_param("/run_id"))
    except PiprosError:
        return None
    finally:
        client.close()


def logs_main() -> None:
    """Run the command. Exit the process on failure."""
    from pipros.cli.roslaunch_logs import main

    code = main()
    if code:
        sys.exit(code)
