"""The processes that `script/bench fleet` starts: `fleet_workers.py NAME ARGUMENT...`."""

import contextlib
import os
import sys
import threading
import time

DEADLINE_S = 60.0
TOPICS = 20


class TcprosEnd:
    """One end of a path, as a node on a master. `sends` and `receives` are its topics."""

    def __init__(self, master, sends, receives, on_message):
        from pipros.basics.env import Environment
        from pipros.msg import load_message_class
        from pipros.node import Node

        # bytes, as in images; encoding and decoding 1 MB of text would take longer than sending it
        self._class = load_message_class("std_msgs/UInt8MultiArray")
        self._node = Node("bench", anonymous=True, environment=Environment(master_uri=master))
        self._node.start()
        # without a queue, `publish` waits for room, as Zenoh does with CongestionControl.BLOCK
        self._publisher = self._node.advertise(sends, self._class, queue_size=None)
        self._node.subscribe(receives, self._class, lambda message: on_message(message.data))

    def send(self, body):
        self._publisher.publish(self._class(data=body))


def count(place, sends, receives):
    """Count the messages. Print the count for each line of input."""
    seen = [0]

    def add(_):
        seen[0] += 1

    end = TcprosEnd(place, sends, receives, add)
    print("ready", flush=True)
    for _ in sys.stdin:
        print(seen[0], flush=True)
    del end  # keeps the session open until here


def flood(place, sends, receives, size, rate):
    """Send, at `rate` per second or as fast as possible, until standard input ends."""
    end = TcprosEnd(place, sends, receives, lambda _: None)
    body = b"x" * size
    print("ready", flush=True)
    is_over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), is_over.set()), daemon=True).start()
    begin, sent = time.monotonic(), 0
    while not is_over.is_set():
        end.send(body)
        sent += 1
        if rate:
            is_over.wait(max(0.0, begin + sent / rate - time.monotonic()))
    os._exit(0)


def many(router, first, number):
    """Run `number` members with 20 topics each."""
    import itertools

    from pipros.fleet import keys
    from pipros.fleet.agent import new_instance
    from pipros.fleet.directory import Directory, DirectoryEntry, to_json
    from pipros.fleet.zenoh_connecting import connect
    from pipros.fleet.zenoh_session import LinkFailed
    from pipros.msg import load_message_class

    def connected():
        while True:
            with contextlib.suppress(LinkFailed):  # timeouts on a busy machine
                return connect(router)

    held, counter = [], itertools.count()
    md5sum = load_message_class("std_msgs/String")._md5sum
    entries = tuple(DirectoryEntry(f"/topic{each}", "std_msgs/String", md5sum) for each in range(TOPICS))

    def join():
        while (index := next(counter)) < number:
            link, name, instance = connected(), f"robot{first + index}", new_instance()
            document = to_json(Directory(name, instance, 1, entries))

            def answer(question, document=document):
                question.answer(document)
                question.close()

            held.append((link, link.serve(keys.directory(name), answer)))
            held.append(link.declare_token(keys.live(name, 1, instance)))

    threads = [threading.Thread(target=join) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print("ready", flush=True)
    sys.stdin.read()
    os._exit(0)


def senders(router, number, rate, size):
    """Send `rate` messages per second, of `size` bytes, from each of `number` members.

    Each message begins with the time at which it was sent.
    """
    from pipros.fleet import keys
    from pipros.fleet.zenoh_connecting import connect

    links = [(connect(router), keys.topic(f"robot{each}", "/data")) for each in range(number)]
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    print("ready", flush=True)
    begin, sent = time.monotonic(), 0
    while True:
        for link, key in links:
            link.put(key, time.monotonic_ns().to_bytes(8, "little").ljust(size))
            sent += 1
            time.sleep(max(0.0, begin + sent / rate / number - time.monotonic()))


def watch(router, pause_ms):
    """Receive all messages, with a pause after each.

    For each line of input, print the number of messages since the previous line, and the 95th percentile of
    their delays in us.
    """
    from pipros.fleet import keys
    from pipros.fleet.zenoh_connecting import connect

    delays = []

    def take(_key, payload, _attachment):
        delays.append((time.monotonic_ns() - int.from_bytes(payload[:8], "little")) // 1000)
        if pause_ms:
            time.sleep(pause_ms / 1000)

    link = connect(router)
    held = link.subscribe(keys.topic("*", keys.EVERY), take)
    print("ready", flush=True)
    for _ in sys.stdin:
        found = sorted(delays)
        delays.clear()
        print(len(found), found[len(found) * 95 // 100] if found else 0, flush=True)
    del held  # keeps the subscription until here
    os._exit(0)


WORKERS = {each.__name__: each for each in (count, flood, many, senders, watch)}


if __name__ == "__main__":
    worker, *words = sys.argv[1:]
    WORKERS[worker](*(int(each) if each.isdecimal() else each for each in words))
