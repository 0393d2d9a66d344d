#!/usr/bin/env python3
"""What the writers and readers of pipros, Fast DDS and Cyclone DDS send in the same situations.

    script/bench wire [--kinds SUBNET,fast-udp] [--only late,lost]

For each situation, both ends are of the same kind, in a network of their own, and tshark captures what the
endpoints of user topics send. A line is a datagram: the milliseconds since the first one, `>` if a writer
sent it and `<` if a reader did, then its submessages with their sequence numbers and flags (final, qos, key).
Further fragments are counted. The table in docs/internals/rtps.md was made from this.
"""

import contextlib
import os
import struct
import subprocess
import tempfile
import time
from pathlib import Path

from table import heed_interrupts, options_of

from tests.support.dds_peers import Peers
from tests.support.processes import Processes
from tests.support.waiting import wait_until

LOSE = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/socket.h>
typedef ssize_t (*sender)(int, const struct msghdr *, int);
ssize_t sendmsg(int to, const struct msghdr *message, int flags) {
  sender send = (sender)dlsym(RTLD_NEXT, "sendmsg");
  size_t size = 0;
  for (size_t part = 0; part < message->msg_iovlen; part++) size += message->msg_iov[part].iov_len;
  return size > 1200 && rand() < RAND_MAX * atof(getenv("LOSS")) ? (ssize_t)size : send(to, message, flags);
}
ssize_t sendto(int to, const void *data, size_t size, int flags, const struct sockaddr *address,
               socklen_t length) {
  struct iovec part = {(void *)data, size};
  struct msghdr message = {(void *)address, length, &part, 1, 0, 0, 0};
  return sendmsg(to, &message, flags);
}
"""
"""Loses a share of the datagrams of more than 1,200 bytes that a program sends."""
TOPIC = "rt/wire"
ACKNACK, HEARTBEAT, GAP, INFO_TS, NACK_FRAG, HEARTBEAT_FRAG, DATA, DATA_FRAG = (
    6,
    7,
    8,
    9,
    0x12,
    0x13,
    0x15,
    0x16,
)
FLAGS = {HEARTBEAT: ((2, "final"), (4, "alive")), ACKNACK: ((2, "final"),), DATA: ((2, "qos"), (8, "key"))}
FLAGS[DATA_FRAG] = ((2, "qos"),)


def losing(folder, loss):
    """Return variables with which a program loses a share of its large datagrams."""
    source, library = folder / "lose.c", folder / "lose.so"
    if not library.exists():
        source.write_text(LOSE)
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "LOSS": str(loss)}


def number(body, at):
    high, low = struct.unpack_from("<iI", body, at)
    return (high << 32) + low


def members(body, at, base):
    """Return the members of a set whose size and bitmap begin at a position."""
    (size,) = struct.unpack_from("<I", body, at)
    words = struct.unpack_from(f"<{(size + 31) // 32}I", body, at + 4)
    return [base + bit for bit in range(size) if words[bit // 32] & (1 << (31 - bit % 32))]


def spans(numbers):
    text = ",".join(map(str, numbers[:6])) + (",..." if len(numbers) > 6 else "")
    return text or "-"


def describe(kind, body):
    """Return a submessage's name and sequence numbers."""
    at = 12 if kind in (DATA, DATA_FRAG) else 8
    if kind == ACKNACK:
        base = number(body, at)
        return f"ACKNACK base {base} missing {spans(members(body, at + 8, base))}"
    if kind == NACK_FRAG:
        (base,) = struct.unpack_from("<I", body, at + 8)
        return f"NACK_FRAG {number(body, at)} fragments {spans(members(body, at + 12, base))}"
    if kind == GAP:
        base = number(body, at + 8)
        return f"GAP {number(body, at)} to {base - 1} and {spans(members(body, at + 16, base))}"
    if kind == HEARTBEAT:
        return f"HEARTBEAT {number(body, at)} to {number(body, at + 8)}"
    if kind == HEARTBEAT_FRAG:
        return f"HEARTBEAT_FRAG {number(body, at)} to fragment {struct.unpack_from('<I', body, at + 8)[0]}"
    if kind == DATA_FRAG:
        first, count, size = struct.unpack_from("<IHH", body, at + 8)
        return (
            f"DATA_FRAG {number(body, at)} fragment {first}"
            + (f" and {count - 1} more" if count > 1 else "")
            + f" of {size} B"
        )
    return f"DATA {number(body, at)}"


def lines(datagram):
    """Return which side sent a datagram, and its submessages on user topics."""
    at, side, found = 20, "", []
    while at + 4 <= len(datagram):
        kind, flags, length = struct.unpack_from("<BBH", datagram, at)
        body = datagram[at + 4 : at + 4 + length] if length else datagram[at + 4 :]
        if kind in (ACKNACK, NACK_FRAG, GAP, HEARTBEAT, HEARTBEAT_FRAG, DATA, DATA_FRAG):
            start = 4 if kind in (DATA, DATA_FRAG) else 0
            reader, writer = body[start : start + 4], body[start + 4 : start + 8]
            if writer[3] in (2, 3):
                side = "<" if kind in (ACKNACK, NACK_FRAG) else ">"
                words = [name for bit, name in FLAGS.get(kind, ()) if flags & bit]
                if side == ">" and reader == bytes(4):
                    words.append("to all")
                if kind in (DATA, DATA_FRAG) and datagram[at - 12] == INFO_TS and datagram[at - 10] == 8:
                    words.append("time")
                found.append(describe(kind, body) + (f" [{' '.join(words)}]" if words else ""))
        at += 4 + length if length else len(datagram)
    return side, found


def datagrams(file):
    """Yield the time and the payload of each UDP datagram in a capture."""
    data, at = file.read_bytes(), 24
    while at + 16 <= len(data):
        seconds, micros, size, _ = struct.unpack_from("<IIII", data, at)
        packet = data[at + 16 : at + 16 + size]
        at += 16 + size
        if packet[14 + 20 + 8 :][:4] == b"RTPS":
            yield seconds + micros / 1e6, packet[14 + 20 + 8 :]


def show(file, most):
    began, count, pending, last = None, 0, 0, None
    for when, datagram in datagrams(file):
        side, found = lines(datagram)
        if not found:
            continue
        began = began or when
        if all(each.startswith("DATA_FRAG") for each in found) and last == (side, "DATA_FRAG"):
            pending += 1
            continue
        last = side, found[-1].split()[0]
        if pending:
            print(f"            and {pending} datagrams with fragments")
            pending = 0
        print(f"    {(when - began) * 1000:8.1f} {side} {'; '.join(found)}")
        count += 1
        if count == most:
            break


def small(peers, kind):
    reader = peers.start(kind, "sub", TOPIC, "reliable")
    reader.wait_for("ready")
    writer = peers.start(kind, "pub", TOPIC, 3, 99, 100_000, "reliable")
    reader.wait_for("got 2")
    time.sleep(5)  # for heartbeats that are repeated
    end(writer, reader)


def large(peers, kind):
    reader = peers.start(kind, "sub", TOPIC, "reliable")
    reader.wait_for("ready")
    writer = peers.start(kind, "pub", TOPIC, 2, 300_000, 100_000, "reliable")
    reader.wait_for("got 1")
    end(writer, reader)


def late(peers, kind):
    writer = peers.start(kind, "pub", TOPIC, 3, 99, 0, "latched")
    writer.wait_for("published")
    reader = peers.start(kind, "sub", TOPIC, "latched")
    reader.wait_for("got 2")
    end(writer, reader)


def displaced(peers, kind):
    """Samples of 300 kB, of which the writer keeps one, while the reader still lacks fragments."""
    reader = peers.start(kind, "sub", TOPIC, "latched")
    reader.wait_for("ready")
    writer = peers.start(kind, "pub", TOPIC, 400, 300_000, 5_000, "latched")
    writer.wait_for("published")
    wait_until(lambda: any(line.startswith("got") for line in reader.lines), 30)
    end(writer, reader)


def services(peers, kind):
    server = peers.start(kind, "server", "/add")
    server.wait_for("ready")
    clients = [peers.start(kind, "client", "/add", 2) for _ in range(2)]
    for client in clients:
        client.wait_for("right 2")
    end(*clients, server)


def end(*processes):
    for each in processes:
        each.end_input()
        each.wait()


SITUATIONS = {
    "small": (small, 0),
    "large": (large, 0),
    "lost": (large, 0.15),
    "late": (late, 0),
    "displaced": (displaced, 0.1),
    "services": (services, 0),
}


def main():
    heed_interrupts()
    options = options_of(
        __doc__, kinds="SUBNET,fast-udp,cyclone,cyclone-wheel", only=",".join(SITUATIONS), lines=60
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for situation in options.only.split(","):
            act, loss = SITUATIONS[situation]
            for kind in options.kinds.split(","):
                processes = Processes({**os.environ, **losing(folder, loss)}, folder)
                with contextlib.closing(Peers(processes)) as peers:
                    file = folder / f"{situation}-{kind}.pcap"
                    tshark = peers.run(
                        "tshark", "-i", "lo", "-B", "256", "-F", "pcap", "-w", file, "-f", "udp"
                    )
                    tshark.wait_for("Capturing")
                    wait_until(lambda f=file: f.exists() and f.stat().st_size >= 24, 20)
                    act(peers, kind)
                    time.sleep(1)  # tshark reads with a delay
                    tshark.press_ctrl_c()
                    tshark.wait()
                print(f"{situation}, {kind}:")
                show(file, options.lines)


if __name__ == "__main__":
    main()
