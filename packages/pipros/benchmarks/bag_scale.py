#!/usr/bin/env python3
"""Bags at scale: `info` on 10 GB, memory, playing at 1 kHz, recording images; genuine rosbag in the same run.

    script/bench bag_scale [--only info,memory,play,record] [--dir FOLDER]

`info` creates sparse bags, in which all records exist but the messages are holes. `memory` prints the maximum
resident size. `play` plays at 1 kHz to genuine `record`, whose reception times show the delays. `record`
makes genuine `play` publish images of 1 MB faster and faster, and counts the images in the file. Each part
takes 20 to 60 seconds.
"""

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from io import BytesIO
from pathlib import Path

from table import heed_interrupts, options_of

from pipros.bag import BagReader, BagWriter
from pipros.bag.connection import Connection, connection_record
from pipros.bag.index import ChunkInfo, chunk_header_bytes, chunk_info_record, index_record
from pipros.bag.records import ENTRY, MAGIC, U32, Op, file_header, record_bytes, time_bytes
from pipros.bag.writer import CHUNK_BYTES
from pipros.msg import load_message_class

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "build"))
from tests.support.waiting import wait_until

PORT = 11397
MERGE = """
import sys
from pipros.bag import BagReader, merged
sum(1 for _ in merged([BagReader(path) for path in sys.argv[1:]]))
"""
OURS = str(Path(sys.executable).parent / "rosbag")
GENUINE = "/usr/bin/rosbag"
SIDES = (("pipros", OURS), ("genuine", GENUINE))
RECORDERS = (("pipros", [OURS, "record"]), ("genuine", ["/usr/lib/rosbag/record"]))
PLAYERS = (("pipros", [OURS, "play"]), ("genuine", ["/usr/lib/rosbag/play"]))


def environment(program):
    """Return the environment for the programs of one implementation."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS_"))}
    kept["ROS_MASTER_URI"] = f"http://127.0.0.1:{PORT}"
    if program.startswith("/usr/"):
        kept["PATH"] = "/usr/bin:/bin"
    return kept


def started(argv, folder):
    return subprocess.Popen(
        argv, cwd=folder, env=environment(argv[0]), stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def seconds_and_megabytes(argv, folder):
    """Run a program. Return its duration in seconds and its maximum resident size in MB."""
    start = time.perf_counter()
    process = started(argv, folder)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    if status:
        raise RuntimeError(f"{argv} ended with {status}")
    return time.perf_counter() - start, usage.ru_maxrss / 1024


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


def recorded(recorder, player, topic, folder):
    """Return the times in nanoseconds at which `recorder` received the messages that `player` published."""
    recording = started([*recorder, "-O", "out.bag", "-b", "2000", topic], folder)
    wait_until((folder / "out.bag.active").exists, 30)
    playing = started([*player, "-q", "-k", "-d", "2", "--queue", "1000"], folder)
    size, since = 0, time.monotonic() + 3
    # When a player ends, it drops messages that its subscribers have not received yet.
    while time.monotonic() < since + 1.5:
        time.sleep(0.1)
        now = (folder / "out.bag.active").stat().st_size
        size, since = (now, max(since, time.monotonic())) if now != size else (size, since)
    for process in (playing, recording):
        process.send_signal(signal.SIGINT)
        process.wait()
    with BagReader(folder / "out.bag") as bag:
        times = [each[1] * 10**9 + each[2] for each in bag.raw_messages()]
    (folder / "out.bag").unlink()
    return times


def play(folder):
    count = 5000
    make_bag(
        folder / "khz.bag", "/x", "std_msgs/Int32", bytes(4), range(10**12, 10**12 + count * 10**6, 10**6)
    )
    for side, player in PLAYERS:
        times = recorded(RECORDERS[1][1], [*player, "khz.bag"], "/x", folder)
        took = (times[-1] - times[0]) / 1e9 / (len(times) - 1) * (count - 1)
        late = [(at - n * 10**6) / 1e6 for n, at in enumerate(times)]
        middle = sorted(late)[len(late) // 2]
        off = sorted(abs(each - middle) for each in late)
        print(
            f"play at 1 kHz {'':14} {side:8} {100 * (took / (count / 1000) - 1):+8.3f} % of the time, "
            f"{off[len(off) // 2]:.2f} ms off the usual delay at the median, "
            f"{off[len(off) * 99 // 100]:.2f} at 99 %, "
            f"{count - len(times)} lost",
            flush=True,
        )


def record(folder):
    image = load_message_class("sensor_msgs/Image")(height=1000, width=1000, encoding="mono8", step=1000)
    image.data = os.urandom(1000000)
    buffer = BytesIO()
    image.serialize(buffer)
    count = 150
    times = range(10**12, 10**12 + count * 20_000_000, 20_000_000)
    make_bag(folder / "images.bag", "/camera", "sensor_msgs/Image", buffer.getvalue(), times)
    for rate in (1, 2, 4, 8):
        for side, recorder in RECORDERS:
            player = [*PLAYERS[1][1], "-r", str(rate), "images.bag"]
            got = recorded(recorder, player, "/camera", folder)
            lasted = (got[-1] - got[0]) / 1e9
            print(
                f"record images, {50 * rate:4} MB/s {'':4} {side:8} {len(got):5} of {count}, "
                f"received at {(len(got) - 1) / max(lasted, 1e-9):.0f} MB/s",
                flush=True,
            )


PARTS = {"info": info, "memory": memory, "play": play, "record": record}


def main():
    options = options_of(__doc__, only=",".join(PARTS), dir="")
    heed_interrupts()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory(dir=options.dir or None) as name:
        folder = Path(name)
        master = started([str(Path(OURS).with_name("rosmaster")), "--core", "-p", str(PORT)], folder)
        try:
            for part in options.only.split(","):
                PARTS[part](folder)
        finally:
            master.send_signal(signal.SIGINT)
            master.wait()


if __name__ == "__main__":
    main()
