"""`roslaunch-logs`: prints the log folder of the current run."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from pipros_tools.cli.entry_point import command
from pipros_tools.launch.run_id import is_run_id, run_id_problem

NO_MASTER = 2


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the folder.

    Return 2 if no master answers or the master has no run id, and 1 if the run id is not a valid folder name.
    """
    _ = argv
    environment = Environment.from_os()
    client = MasterClient(environment.master_uri, "/roslaunch", timeout_s=5.0)
    try:
        run_id = client.get_param("/run_id")
    except PiprosError:
        print("No active roscore", file=sys.stderr)
        return NO_MASTER
    finally:
        client.close()
    if not is_run_id(run_id):
        print(run_id_problem(run_id, "/run_id on the parameter server"), file=sys.stderr)
        return 1
    print(environment.log_dir / run_id)
    return 0


if __name__ == "__main__":
    sys.exit(main())
