"""The process of an SQL query; `pipros.assistants.query` starts it, with a request on standard input."""

from __future__ import annotations

import json
import sys
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.rooms import loaded, verbs


def main() -> int:
    """Limit this process, and run the query. Return the exit code."""
    request: dict[str, Any] = json.load(sys.stdin)
    _limit(request["seconds"], request["bytes"])
    query = loaded(verbs("rosbag")["query"].target)
    try:
        return int(query(["-q", "--", request["bag"], request["sql"]]))
    except (PiprosError, OSError, MemoryError) as error:
        print(str(error) or type(error).__name__, file=sys.stderr)
        return 1


def _limit(seconds: int, limit_bytes: int) -> None:
    """Limit the processor time, the memory and the files of this process, where the system can."""
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
