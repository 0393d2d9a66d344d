"""Run untrusted SQL queries on a bag, such as queries from assistants, in a process with limited resources.

The database contains only the topics that the query names, and has no access to files or networks. The time,
memory and file sizes of the process are limited (on Windows, only the time), and its folder is removed
afterwards.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from pipros_data.sql import QueryError

OUTPUT_BYTES: Final = 4 * 1024 * 1024
"""Maximum size of a result; the rest is dropped."""
_ERROR_BYTES: Final = 4000
_PROGRAM: Final = "pipros_data.query_process"


def run_query(bag: Path, sql: str, *, limit_s: float, limit_bytes: int) -> str:
    """Return the rows of a query as CSV, at most `OUTPUT_BYTES`.

    Args:
        limit_s: limit on the elapsed time and on the processor time of the process.
        limit_bytes: limit on the memory of the process and on the size of each of its files.

    Raises:
        QueryError: the query fails or takes too long.
    """
    with TemporaryDirectory(prefix="pipros-query-") as folder:
        output, errors = Path(folder, "output"), Path(folder, "errors")
        work = Path(folder, "work")
        work.mkdir()
        request = {"bag": str(bag), "sql": sql, "bytes": limit_bytes, "seconds": int(limit_s) + 1}
        with output.open("wb") as out, errors.open("wb") as err:
            try:
                ended = subprocess.run(  # noqa: S603
                    [sys.executable, "-m", _PROGRAM],
                    input=json.dumps(request).encode(),
                    stdout=out,
                    stderr=err,
                    cwd=work,
                    env={**os.environ, "TMPDIR": str(work)},
                    timeout=limit_s,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise QueryError(f"the query took longer than {limit_s:g} s; select fewer messages") from None
        if ended.returncode != 0:
            reason = _beginning(errors, _ERROR_BYTES) or f"it ended with the code {ended.returncode}"
            raise QueryError(reason.strip())
        text = _beginning(output, OUTPUT_BYTES)
        is_cut = output.stat().st_size > OUTPUT_BYTES
    return text[: text.rfind("\n") + 1] if is_cut else text


def _beginning(file: Path, limit_bytes: int) -> str:
    with file.open("rb") as opened:
        return opened.read(limit_bytes).decode("utf-8", "replace")
