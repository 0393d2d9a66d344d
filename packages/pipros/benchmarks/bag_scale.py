#!/usr/bin/env python3
"""Bags at scale: `info` on 10 GB, memory, and processor time of `play`; genuine rosbag in the same run.

    script/bench bag_scale [--only info,memory,play] [--dir FOLDER]

`info` creates sparse bags, in which all records exist but the messages are holes. `memory` prints the maximum
resident size, `play` the medians of processor seconds, of which each start of Python takes 0.15, beside the
genuine program in C++. Each part takes 20 to 60 seconds.
"""

import contextlib
import io
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from programs import Programs
from table import heed_interrupts, options_of

from pipros.msg import load_message_class
from pipros_tools.bag import BagWriter
from pipros_tools.bag.connection import Connection, connection_record
from pipros_tools.bag.index import ChunkInfo, chunk_header_bytes, chunk_info_record, index_record
from pipros_tools.bag.records import ENTRY, MAGIC, U32, Op, file_header, record_bytes, time_bytes
from pipros_tools.bag.writer import CHUNK_BYTES

MERGE = """
import sys
from pipros_tools.bag import BagReader, merged
sum(1 for _ in merged([BagReader(path) for path in sys.argv[1:]]))
"""
OURS = str(Path(sys.executable).parent / "rosbag")
GENUINE = "/usr/bin/rosbag"
GENUINE_PLAY = "/usr/lib/rosbag/play"
SUBSCRIBE = """
import sys
import rospy
rospy.init_node("subscriber")
rospy.Subscriber(sys.argv[1], rospy.AnyMsg, lambda _: None, queue_size=1000, buff_size=2**24)
rospy.spin()
"""
SIDES = (("pipros", OURS), ("genuine", GENUINE))


def environment(program):
    """Return the environment for the programs of one implementation."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    if program.startswith("/usr/"):
        kept["PATH"] = "/usr/bin:/bin"
    return kept


def seconds_and_megabytes(argv, folder):
    """Run a program. Return its duration in seconds and its maximum resident size in MB.

    The size is read while it runs, because that of `os.wait4` is at least the size of this process.
    """
    start, quiet, found = time.perf_counter(), subprocess.DEVNULL, None
    variables = environment(argv[0])
    process = subprocess.Popen(argv, cwd=folder, env=variables, stdin=quiet, stdout=quiet, stderr=quiet)
    while process.poll() is None:
        found = re.search(r"VmHWM:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text()) or found
        time.sleep(0.005)
    if process.returncode:
        raise RuntimeError(f"{argv} ended with {process.returncode}")
    return time.perf_counter() - start, int(found[1]) / 1024


def header(topic, name):
    cls = load_message_class(name)
    fields = {"topic": topic, "type": name, "md5sum": cls._md5sum, "message_definition": cls._full_text}
    return {key: value.encode() for key, value in fields.items()}


def make_sparse(path, size, topics):
    """Write a bag of about this size whose messages are holes, except those of the first topic.

    Everything else is written as by a recorder.
    """
    connections = [
        Connection(n, f"/topic{n}", header(f"/topic{n}", "std_msgs/String")) for n in range(topics)
    ]
    counts = {**dict.fromkeys(range(topics), 10), 0: 1}
    chunks, position = [], len(MAGIC) + 8 + 4096
    with path.open("wb") as file:
        while position < size:
            file.seek(position)
            second = 1000 + len(chunks)
            chunks.append(ChunkInfo(position, second * 10**9, second * 10**9 + 9, counts))
            file.write(chunk_header_bytes("none", CHUNK_BYTES, CHUNK_BYTES))
            end = file.tell() + CHUNK_BYTES
            fields = {"op": bytes([Op.MESSAGE]), "conn": U32.pack(0), "time": time_bytes(second * 10**9)}
            file.write(record_bytes(fields, U32.pack(4) + b"%04d" % (len(chunks) % 10000)))
            file.seek(end)
            entries = b"".join(ENTRY.pack(second, n, n * 100) for n in range(10))
            first = ENTRY.pack(second, 0, 0)
            file.write(b"".join(index_record(n, entries if n else first) for n in range(topics)))
            position = file.tell()
        file.write(b"".join(map(connection_record, connections)))
        file.write(b"".join(map(chunk_info_record, chunks)))
        file.seek(0)
        file.write(MAGIC + file_header(position, topics, len(chunks)))


def make_bag(path, topic, name, data, times):
    """Write a bag that repeats one serialized message, with these timestamps in nanoseconds."""
    with path.open("w+b") as file:
        writer = BagWriter(file)
        connection = writer.add_connection(topic, header(topic, name))
        for time_ns in times:
            writer.write(connection, *divmod(time_ns, 10**9), data)
        writer.finish()


def info(folder):
    for label, size, topics in (("10 GB, 20 topics", 10**10, 20), ("1 GB, 1,000 topics", 10**9, 1000)):
        path = folder / "sparse.bag"
        make_sparse(path, size, topics)
        for side, program in SIDES:
            runs = [seconds_and_megabytes([program, "info", path.name], folder) for _ in range(3)]
            took, megabytes = min(runs)
            print(f"info, {label:22} {side:8} {took:8.2f} s {megabytes:8.0f} MB", flush=True)
        path.unlink()


def memory(folder):
    data = (1000).to_bytes(4, "little") + bytes(1000)
    for megabytes in (50, 200):
        for name in ("a", "b"):
            times = range(10**12, 10**12 + megabytes * 10**9, 10**6)
            make_bag(folder / f"{name}.bag", f"/{name}", "std_msgs/String", data, times)
        for side, program in SIDES:
            work = {"filter": [program, "filter", "a.bag", "out.bag", "t.nsecs < 5000000"]}
            work["play -i"] = [program, "play", "-q", "-i", "a.bag", "b.bag"]
            if side == "pipros":
                work["merge"] = [sys.executable, "-c", MERGE, "a.bag", "b.bag"]
            for what, argv in work.items():
                used = seconds_and_megabytes(argv, folder)[1]
                print(f"{what:8} of {megabytes:4} MB {'':13} {side:8} {used:19.0f} MB", flush=True)


def processor_s(argv, folder):
    """Run a program. Return its processor time in seconds."""
    process = subprocess.Popen(
        argv, cwd=folder, env=environment(argv[0]), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{argv} ended with {process.returncode}")
    return used.ru_utime + used.ru_stime


def play(folder):
    """Play 100 s of small messages and of images: at once, and to a subscriber at 20 times the speed."""
    string = (100).to_bytes(4, "little") + bytes(100)
    make_bag(folder / "small.bag", "/small", "std_msgs/String", string, range(10**12, 10**12 + 10**11, 10**6))
    image = io.BytesIO()
    load_message_class("sensor_msgs/Image")(
        height=600, width=800, step=2400, data=bytes(1_440_000)
    ).serialize(image)
    make_bag(
        folder / "large.bag",
        "/large",
        "sensor_msgs/Image",
        image.getvalue(),
        range(10**12, 10**12 + 10**11, 5 * 10**8),
    )
    for name in ("small", "large"):
        for what, options in ((f"{name} -i", ["-i"]), (f"{name} -r 20, subscribed", ["-r", "20"])):
            used = {side: [] for side, _ in SIDES}
            for _ in range(3):
                for side, program in (("pipros", [OURS, "play"]), ("genuine", [GENUINE_PLAY])):
                    with subscriber(f"/{name}", is_wanted="-r" in options):
                        used[side].append(processor_s([*program, "-q", *options, f"{name}.bag"], folder))
            ours, genuine = (statistics.median(used[side]) for side in ("pipros", "genuine"))
            print(
                f"play {what:28} pipros {ours:6.2f} s  genuine {genuine:6.2f} s  {ours / genuine:.2f}",
                flush=True,
            )


@contextlib.contextmanager
def subscriber(topic, *, is_wanted):
    """Run a process that receives the messages of a topic and does not decode them."""
    if not is_wanted:
        yield
        return
    with subprocess.Popen([sys.executable, "-c", SUBSCRIBE, topic]) as process:
        try:
            yield
        finally:
            process.terminate()


PARTS = {"info": info, "memory": memory, "play": play}


def main():
    options = options_of(__doc__, only=",".join(PARTS), dir="")
    heed_interrupts()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory(dir=options.dir or None) as name, Programs() as programs:
        os.environ["ROS_MASTER_URI"] = programs.environment["ROS_MASTER_URI"]
        for part in options.only.split(","):
            PARTS[part](Path(name))


if __name__ == "__main__":
    main()
