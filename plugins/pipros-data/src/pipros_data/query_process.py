"""The process that runs an SQL query. `pipros_data.limited_query` sends it a request on standard input."""

from __future__ import annotations

import json
import sys
from tempfile import TemporaryDirectory
from typing import Any

from pipros.basics.errors import MissingExtra, PiprosError
from pipros_data.files import print_csv
from pipros_data.opening import open_bags
from pipros_data.sql import Database, queried


def main() -> int:
    """Limit this process, and run the query. Return the exit code."""
    request: dict[str, Any] = json.load(sys.stdin)
    _limit(request["seconds"], request["bytes"])
    sql = request["sql"]
    try:
        with (
            open_bags(request["bag"]) as bags,
            TemporaryDirectory(prefix="tables-") as folder,
            Database(folder, bags.topics()) as database,
        ):
            print_csv(queried(database, sql, bags.topics(), bags.batches))
    except (PiprosError, MissingExtra, OSError, MemoryError, ValueError) as error:
        print(str(error) or type(error).__name__, file=sys.stderr)
        return 1
    return 0


def _limit(seconds: int, limit_bytes: int) -> None:
    """Limit the processor time, the memory and the file sizes of this process, except on Windows."""
    if sys.platform == "win32":
        return
    import resource

    for kind, value in (
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_DATA, limit_bytes),
        (resource.RLIMIT_FSIZE, limit_bytes),
        (resource.RLIMIT_CORE, 0),
    ):
        most = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (value if most == resource.RLIM_INFINITY else min(value, most), most))


if __name__ == "__main__":
    sys.exit(main())
