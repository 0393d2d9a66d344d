"""SQL over a bag, in a process of its own.

The query runs like `rosbag query`, which another room adds to `rosbag`: in a database that has only the
topics that the query names, without access to files and networks. The process has limits on its time, memory
and files, and a folder, which is removed afterwards.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from pipros.assistants.answer import ToolRefused
from pipros.assistants.limits import AssistantLimits
from pipros.basics.env import Environment
from pipros.basics.rooms import verbs

OUTPUT_BYTES: Final = 4 * 1024 * 1024
"""The rows of a result that are kept for an answer and its continuations."""
_ERROR_BYTES: Final = 4000
_PROGRAM: Final = "pipros.assistants.query_process"


def run_query(bag: Path, sql: str, limits: AssistantLimits, environment: Environment) -> str:
    """Return the rows of a query as CSV, at most `OUTPUT_BYTES`.

    Raises:
        ToolRefused: the query fails or takes too long, or no room can run it.
    """
    if "query" not in verbs("rosbag"):
        raise ToolRefused("this installation of pipros lacks rosbag query, which SQL needs")
    with TemporaryDirectory(prefix="pipros-query-") as folder:
        output, errors = Path(folder, "output"), Path(folder, "errors")
        work = Path(folder, "work")
        work.mkdir()
        request = {"bag": str(bag), "sql": sql, "bytes": limits.assistant_query_bytes}
        request["seconds"] = int(limits.assistant_query_s) + 1
        with output.open("wb") as out, errors.open("wb") as err:
            try:
                ended = subprocess.run(  # noqa: S603
                    [sys.executable, "-m", _PROGRAM],
                    input=json.dumps(request).encode(),
                    stdout=out,
                    stderr=err,
                    cwd=work,
                    env={**os.environ, "TMPDIR": str(work), "ROS_HOME": str(environment.ros_home)},
                    timeout=limits.assistant_query_s,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise ToolRefused("the query takes too long; select fewer messages") from None
        if ended.returncode != 0:
            reason = _beginning(errors, _ERROR_BYTES) or f"it ended with the code {ended.returncode}"
            raise ToolRefused("the query failed; data has the reason", reason)
        text = _beginning(output, OUTPUT_BYTES)
    return text if len(text) < OUTPUT_BYTES // 4 else text[: text.rfind("\n") + 1]


def _beginning(file: Path, limit_bytes: int) -> str:
    with file.open("rb") as opened:
        return opened.read(limit_bytes).decode("utf-8", "replace")
