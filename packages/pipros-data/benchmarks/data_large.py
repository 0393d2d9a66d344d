"""The memory of a table from a bag of 20 GB, in a cgroup of 1 GiB, as root; part of `benchmarks/data.py`."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from sensor_msgs.msg import LaserScan, PointCloud2, PointField

import rosbag
from pipros.msg.time import Time

GIB = 1 << 30
CLOUD_BYTES, SCANS_PER_CLOUD = 1_000_000, 35
ARGUMENTS = {"/scan": (), "/points": ("--every", "20")}
"""Options of `rosbag table`, by topic. All clouds are read, but a file with all of them would have 18 GB."""


def write_large(path: Path, size: int) -> None:
    """Write a bag of about `size` bytes: clouds of random points, and scans."""
    random = np.random.default_rng(1)
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    bodies = [random.bytes(CLOUD_BYTES) for _ in range(8)]
    ranges = random.random((32, 360)).tolist()
    with rosbag.Bag(str(path), "w") as bag:
        for n in range(size // (CLOUD_BYTES + SCANS_PER_CLOUD * 3000)):
            cloud = PointCloud2(height=1, width=CLOUD_BYTES // 12, point_step=12, row_step=CLOUD_BYTES)
            cloud.fields, cloud.data = fields, bodies[n % len(bodies)]
            cloud.header.stamp = Time(n, 0)
            bag.write("/points", cloud, cloud.header.stamp)
            for m in range(SCANS_PER_CLOUD):
                stamp = Time(n, 1 + m * 20_000_000)
                scan = LaserScan(ranges=ranges[m % len(ranges)], intensities=ranges[n % len(ranges)])
                scan.header.stamp = stamp
                bag.write("/scan", scan, stamp)


@contextmanager
def memory_group(limit: int) -> Iterator[tuple[Path, str]]:
    """Yield a new cgroup (version 1 or 2) with this limit, and the name of its file with the peak usage."""
    root = Path("/sys/fs/cgroup/memory")
    limit_file, peak_file = "memory.limit_in_bytes", "memory.max_usage_in_bytes"
    if not root.exists():
        root, limit_file, peak_file = root.parent, "memory.max", "memory.peak"
    folder = root / f"pipros_{os.getpid()}"
    folder.mkdir()
    try:
        (folder / limit_file).write_text(str(limit))
        yield folder, peak_file
    finally:
        folder.rmdir()


def main(gigabytes: float, folder: str | None) -> None:
    """Write a bag, and make a table of each of its topics. Print time and memory."""
    with tempfile.TemporaryDirectory(dir=folder) as name:
        bag = Path(name) / "large.bag"
        write_large(bag, int(gigabytes * 1e9))
        for topic, arguments in ARGUMENTS.items():
            output = Path(name) / "out.parquet"
            program = Path(sys.executable).with_name("rosbag")
            command = [str(program), "table", str(bag), topic, "-o", str(output), *arguments]
            with memory_group(GIB) as (group, peak_file):
                began = time.monotonic()
                process = subprocess.Popen(
                    ["sh", "-c", f'echo $$ >{group}/cgroup.procs; exec "$@"', "sh", *command]
                )
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
                peak = int((group / peak_file).read_text())
            print(
                f"table of {topic} from a bag of {bag.stat().st_size / 1e9:.1f} GB in a cgroup of 1 GiB: "
                f"exit code {process.returncode}, {time.monotonic() - began:.0f} s, peak resident memory "
                f"{usage.ru_maxrss / 1024:.0f} MiB (goal: 1024), of the cgroup with the page cache "
                f"{peak / (1 << 20):.0f} MiB; {output.stat().st_size / 1e9:.2f} GB written",
                flush=True,
            )
            if process.returncode:
                raise SystemExit(1)
            output.unlink()
