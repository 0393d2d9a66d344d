# mypy: ignore-errors
"""A peer on plain Zenoh for benchmarks. It has the command line of rtps_peer.py, but begins with a router."""

import json
import queue
import struct
import sys
import threading
import time

import zenoh


def connect(router):
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [router],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def report(sample):
    payload = sample.payload.to_bytes()
    number, size = struct.unpack_from("<II", payload)
    right = payload[8:] == bytes([number % 256]) * size
    print("got" if right else "wrong", number, size, flush=True)


def main(router, mode, name, _type, *words):
    key = name.strip("/")
    with connect(router) as session:
        if mode == "pub":
            count, size, period_us = map(int, words[:3])
            publisher = session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK)
            print("ready", flush=True)
            while not publisher.matching_status.matching:
                time.sleep(0.005)
            for number in range(count):
                publisher.put(struct.pack("<II", number, size) + bytes([number % 256]) * size)
                if period_us:
                    time.sleep(period_us / 1e6)
            print("published", flush=True)
        elif mode == "sub":
            # `report` runs in another thread, so that it does not block Zenoh's thread.
            arrived = queue.SimpleQueue()
            session.declare_subscriber(key, zenoh.handlers.Callback(arrived.put, indirect=False))
            threading.Thread(
                target=lambda: [report(each) for each in iter(arrived.get, None)], daemon=True
            ).start()
            print("ready", flush=True)
        elif mode == "server":

            def answer(query):
                a, b = struct.unpack("<qq", query.payload.to_bytes())
                query.reply(key, struct.pack("<q", a + b))

            session.declare_queryable(key, zenoh.handlers.Callback(answer, indirect=False))
            print("ready", flush=True)
        elif mode == "client":
            count, right = int(words[0]), 0
            while not list(session.get(key, payload=struct.pack("<qq", 0, 0))):
                time.sleep(0.01)
            began = time.monotonic()
            for number in range(count):
                (reply,) = session.get(key, payload=struct.pack("<qq", number, 1000))
                right += struct.unpack("<q", reply.ok.payload.to_bytes())[0] == number + 1000
            print("right", right, flush=True)
            print(f"{(time.monotonic() - began) / count * 1e6:.0f} us per call", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main(*sys.argv[1:])
