"""A recording that is killed at any moment loses at most the current chunk.

There are ten kills; `PIPROS_KILLED_RECORDINGS=200 script/test -k killed_recording` makes more.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipros_tools.bag import BagReader, NotIndexed
from pipros_tools.cli.rosbag import main
from tests.support.bags import rows_of

RUNS = int(os.environ.get("PIPROS_KILLED_RECORDINGS", "10"))
COMPRESSIONS = ("none", "lz4", "bz2")

WRITER = """
import sys, zlib
from pipros_tools.bag.connection import StoredMessage, received_connection
from pipros_tools.bag.record_files import FileOptions, RecordFiles
from std_msgs.msg import String

header = {"type": "std_msgs/String", "md5sum": String._md5sum, "message_definition": String._full_text}
options = FileOptions(name="run", split=True, size_bytes=60_000, chunk_bytes=3000, compression=sys.argv[1])
files = RecordFiles(options, lambda _: None)
connection = received_connection("/text", header)
files.open(0)
written = 0
while True:
    text = b"%d " % written + b"%x" % zlib.crc32(b"%d" % written) * (written % 40)
    files.write(StoredMessage(connection, written * 10**9, len(text).to_bytes(4, "little") + text))
    written += 1
    if written % 100 == 0:
        files.flush()
        print(written, flush=True)
"""


def killed_after(acknowledged: int, folder: Path, compression: str) -> int:
    """Kill a writer after a number of its reports about the file; return the last number that it
    reported."""
    argv = [sys.executable, "-c", WRITER, compression]
    with subprocess.Popen(argv, cwd=folder, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        told = [writer.stdout.readline() for _ in range(acknowledged)]
        writer.send_signal(signal.SIGKILL)
        told += writer.stdout.readlines()
    return max(int(line) for line in told if line.endswith("\n"))


def numbers(path: Path, *, is_rebuilt: bool = False) -> list[int]:
    with BagReader(path, rebuild_index=is_rebuilt) as bag:
        return [int(row[1].split()[0]) for row in rows_of(bag)]


@pytest.mark.timeout(60 + 3 * RUNS)
def test_a_killed_writer_loses_only_the_current_chunk(tmp_path: Path) -> None:
    seed = random.randrange(10**6)  # noqa: S311
    chance = random.Random(seed)  # noqa: S311
    for run in range(RUNS):
        folder = tmp_path / str(run)
        folder.mkdir()
        told = killed_after(chance.randrange(1, 40), folder, COMPRESSIONS[run % 3])
        files = sorted(folder.glob("run_*"), key=lambda path: int(path.name.split("_")[1].split(".")[0]))

        found: list[int] = []
        for path in files:
            if path.suffix == ".bag":
                found += numbers(path)  # complete, with its index
                continue
            if not path.stat().st_size:
                continue  # killed just after the file was created
            rebuilt = numbers(path, is_rebuilt=True)
            try:
                assert (
                    numbers(path) == rebuilt
                )  # killed after the index was written, before the file was renamed
            except NotIndexed:
                assert main(["reindex", "-q", str(path)]) == 0
                assert numbers(path) == rebuilt
            found += rebuilt

        assert found == list(range(len(found))), f"seed {seed}, run {run}"
        assert len(found) >= told, f"seed {seed}, run {run}"
