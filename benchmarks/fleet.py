#!/usr/bin/env python3
"""The fleet link beside bare Zenoh and direct TCPROS, in one run.

    benchmarks/fleet.py [--only trip,flow,cost,robots,slow,wan] [--rounds 3] [--seconds 2] [--robots 100]
        [--quick]

trip: round trip of a message between two nodes: on one master, there also with a pause of a millisecond
before each trip (`paused`), between two sessions of Zenoh over a router, and between the masters of two
members. flow: messages per second that arrive, sent as fast as possible by a sender that waits for room.
cost: memory and processor time of an agent, idle and at 1,000 messages/s. robots: members with 20 topics
each in two processes, without masters: the time until an operator knows all directories; until an agent
shows all topics on its master, if they are at most 5,000; until all members are back after a restart of the
router; and until half of them, whose process is stopped, count as gone, and are back. slow: two operators
receive 10 messages/s of 10 kB from each of up to 100 robots; one of them handles only 100/s. wan (only if
named, as root): round trips of a command to a robot behind a link of 1 Mbit/s, 50 ms of delay each way and
1 % of lost packets, alone and while the robot sends images of twice the link's bandwidth. Each side is a
process of its own. The sides take turns, and the median of the rounds counts. Nothing else should be
running.
"""

import argparse
import contextlib
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

SIZES = [16, 1_000, 100_000, 1_000_000]
PAUSED = "paused"
PAUSE_S = 0.001  # about the time between the messages of a round trip over a fleet link; threads sleep
DEADLINE_S = 60.0
TOPICS = 20
MOST_TOPICS = 5000  # the limit fleet_topics


# ---- workers, in separate processes


def body_of(size):
    return b"x" * size


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


class ZenohEnd:
    """One end of a path, as a Zenoh session with Zenoh's own callbacks, the fastest way in Python."""

    def __init__(self, router, sends, receives, on_message):
        import zenoh

        config = zenoh.Config()
        for key, value in {
            "mode": "client",
            "connect/endpoints": [router],
            "scouting/multicast/enabled": False,
            "transport/shared_memory/enabled": False,
        }.items():
            config.insert_json5(key, json.dumps(value))
        self._session = zenoh.open(config)
        self._key = f"bench{sends}"
        self._subscriber = self._session.declare_subscriber(
            f"bench{receives}",
            zenoh.handlers.Callback(lambda sample: on_message(sample.payload.to_bytes()), indirect=False),
        )
        self._how = {"congestion_control": zenoh.CongestionControl.BLOCK, "express": True}

    def send(self, body):
        self._session.put(self._key, body, **self._how)


def end_of(side, place, sends, receives, on_message):
    return (ZenohEnd if side == "zenoh" else TcprosEnd)(place, sends, receives, on_message)


def echo(side, place, sends, receives):
    """Send each message back."""
    end = None
    ready = threading.Event()

    def back(body):
        ready.wait(DEADLINE_S)
        end.send(body)

    end = end_of(side, place, sends, receives, back)
    ready.set()
    print("ready", flush=True)
    sys.stdin.read()


def count(side, place, sends, receives):
    """Count the messages. Print the count for each line of input."""
    seen = [0]

    def add(_):
        seen[0] += 1

    end = end_of(side, place, sends, receives, add)
    print("ready", flush=True)
    for _ in sys.stdin:
        print(seen[0], flush=True)
    del end  # keeps the session open until here


def trips(side, place, sends, receives, size, seconds):
    """Print the median and the 95th percentile of the round trip times in us, and their number.

    At least two messages must return.
    """
    arrived = threading.Semaphore(0)
    end = end_of(side, place, sends, receives, lambda _: arrived.release())
    body = body_of(size)
    give_up = time.monotonic() + DEADLINE_S
    while True:  # until the path exists
        end.send(body)
        if arrived.acquire(timeout=0.2):
            break
        if time.monotonic() > give_up:
            raise SystemExit(f"{side}: no message came back")
    while arrived.acquire(timeout=0.5):
        pass
    found = []
    stop = time.monotonic() + seconds
    while time.monotonic() < stop:
        if side == PAUSED:
            time.sleep(PAUSE_S)
        begin = time.perf_counter()
        end.send(body)
        if arrived.acquire(timeout=5):
            found.append(time.perf_counter() - begin)
    print(1e6 * statistics.median(found), 1e6 * statistics.quantiles(found, n=20)[-1], len(found), flush=True)


def flood(side, place, sends, receives, size, rate):
    """Send, at `rate` per second or as fast as possible, until standard input ends."""
    end = end_of(side, place, sends, receives, lambda _: None)
    body = body_of(size)
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


def master():
    """Run a master and print its address."""
    from pipros.master.master import Master

    with Master(port=0) as running:
        print(f"ready {running.uri}", flush=True)
        sys.stdin.read()


def many(router, first, number):
    """Run `number` members with 20 topics each."""
    import itertools

    from pipros.fleet import keys
    from pipros.fleet.agent import new_instance
    from pipros.fleet.directory import Directory, Entry, to_json
    from pipros.fleet.zenoh_session import LinkFailed, connect
    from pipros.msg import load_message_class

    def connected():
        while True:
            with contextlib.suppress(LinkFailed):  # timeouts on a busy machine
                return connect(router)

    held, counter = [], itertools.count()
    md5sum = load_message_class("std_msgs/String")._md5sum
    entries = tuple(Entry(f"/topic{each}", "std_msgs/String", md5sum) for each in range(TOPICS))

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
    from pipros.fleet.zenoh_session import connect

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
    from pipros.fleet.zenoh_session import connect

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


WORKERS = {
    "echo": echo,
    "count": count,
    "trips": trips,
    "flood": flood,
    "many": many,
    "senders": senders,
    "watch": watch,
    "master": master,
}


# ---- the run


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


class Program:
    """A process that ends with the benchmark."""

    def __init__(self, stack, *argv, wait="ready", prefix=(), **environment):
        self.process = subprocess.Popen(
            [*prefix, sys.executable, *argv],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **environment},
        )
        stack.callback(self.end)
        self.first_line = ""
        while wait and wait not in self.first_line:
            self.first_line = self.line()

    def line(self):
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"{self.process.args} ended")
        return line

    def ask_all(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return [int(each) for each in self.line().split()]

    def ask(self):
        return self.ask_all()[0]

    def end(self):
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        self.process.terminate()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def usage(self):
        """Return the processor time in seconds and the resident size in MB."""
        with open(f"/proc/{self.process.pid}/stat") as file:
            fields = file.read().rpartition(")")[2].split()
        with open(f"/proc/{self.process.pid}/status") as file:
            memory = next(line for line in file if line.startswith("VmRSS"))
        ticks = os.sysconf("SC_CLK_TCK")
        return (int(fields[11]) + int(fields[12])) / ticks, int(memory.split()[1]) / 1024


def worker(stack, name, *arguments, **more):
    return Program(stack, os.path.abspath(__file__), "--worker", name, *map(str, arguments), **more)


def pipros(stack, *arguments, wait, **environment):
    code = "import sys; from pipros.cli.pipros import main; sys.exit(main())"
    return Program(stack, "-c", code, *arguments, wait=wait, **environment)


class System:
    """Two masters, a router and two agents."""

    def __init__(self, stack):
        from pipros.master.master import Master

        self.router = f"tcp/127.0.0.1:{free_port()}"
        self.router_program = pipros(stack, "fleet", "router", self.router, wait="router at")
        self.masters = [stack.enter_context(Master(port=0)).uri for _ in "ab"]
        accepts = os.path.join(os.environ.get("TMPDIR", "/tmp"), f"bench-fleet-{os.getpid()}.yaml")  # noqa: S108
        with open(accepts, "w") as file:
            file.write("accept: {topics: [/**]}\n")
        stack.callback(os.unlink, accepts)
        self.agents = [
            pipros(
                stack, "fleet", "join", name, "--router", self.router, wait="joined", ROS_MASTER_URI=master
            )
            for name, master in zip("ab", self.masters, strict=True)
        ]

    def ends(self, side):
        """Return the master or router, the sent and the received topic, for the near and for the far end."""
        if side == "zenoh":
            return (self.router, "/near", "/far"), (self.router, "/far", "/near")
        if side in ("tcpros", PAUSED):
            return (self.masters[0], "/near", "/far"), (self.masters[0], "/far", "/near")
        return (self.masters[0], "/to_b", "/b/to_a"), (self.masters[1], "/to_a", "/a/to_b")


def trip(system, side, size, seconds):
    near, far = system.ends(side)
    with contextlib.ExitStack() as stack:
        worker(stack, "echo", side, *far)
        return float(worker(stack, "trips", side, *near, size, seconds, wait="").line().split()[0])


def flow(system, side, size, seconds):
    near, far = system.ends(side)
    with contextlib.ExitStack() as stack:
        counter = worker(stack, "count", side, *far)
        worker(stack, "flood", side, *near, size, 0)
        give_up = time.monotonic() + DEADLINE_S
        while counter.ask() < 5:
            if time.monotonic() > give_up:
                raise SystemExit(f"{side}: no message arrives")
            time.sleep(0.1)
        time.sleep(0.5)
        begin, first = time.monotonic(), counter.ask()
        time.sleep(seconds)
        return (counter.ask() - first) / (time.monotonic() - begin)


def cost(system, seconds):
    agent = system.agents[0]
    with contextlib.ExitStack() as stack:
        for what in ("idle", "1000/s"):
            if what != "idle":
                near, far = system.ends("fleet")
                counter = worker(stack, "count", "fleet", *far)
                worker(stack, "flood", "fleet", *near, 100, 1000)
                while counter.ask() < 100:
                    time.sleep(0.1)
            begin, before = time.monotonic(), agent.usage()
            time.sleep(seconds)
            after = agent.usage()
            share = 100 * (after[0] - before[0]) / (time.monotonic() - begin)
            print(f"agent, {what}: {share:.1f} % of a core, {after[1]:.0f} MB")


WAN_ROBOT = """
bandwidth_kbit: 900
share:
  topics:
    - {name: /images, priority: low, latest_only: true}
    - {name: /to_operator, priority: high}
accept: {topics: [/from_operator]}
"""


def wan(seconds):
    """Measure a command's round trip between an operator here and a robot behind a narrow link."""
    from narrow_link import HERE, NarrowLink

    from pipros.master.master import Master

    with contextlib.ExitStack() as stack:
        link = stack.enter_context(NarrowLink(kbit=1000, delay_s=0.05, loss=0.01))
        here, robot = {"ROS_IP": "127.0.0.1"}, {"ROS_IP": "127.0.0.1", "prefix": link.prefix}
        router = f"tcp/{HERE}:{free_port()}"
        pipros(stack, "fleet", "router", router, "--without-tls", wait="router at")
        far = worker(stack, "master", **robot).first_line.split()[1]
        near = stack.enter_context(Master(port=0)).uri
        file = stack.enter_context(tempfile.NamedTemporaryFile("w", suffix=".yaml"))
        file.write(WAN_ROBOT)
        file.flush()
        for name, uri, more in (
            ("robot", far, [robot, ["--file", file.name]]),
            ("operator", near, [here, []]),
        ):
            where, options = more
            pipros(
                stack, "fleet", "join", name, "--router", router, *options,
                wait="joined", ROS_MASTER_URI=uri, **where,
            )  # fmt: skip
        worker(stack, "echo", "fleet", far, "/to_operator", "/from_operator", **robot)
        images = worker(stack, "count", "fleet", near, "/unused", "/robot/images", **here)
        for what in ("alone", "with images"):
            if what != "alone":
                worker(stack, "flood", "fleet", far, "/images", "/unused", 25_000, 10, **robot)
                while images.ask() < 2:
                    time.sleep(0.1)
            before, begin = images.ask(), time.monotonic()
            line = worker(
                stack, "trips", "fleet", near, "/robot/from_operator", "/robot/to_operator", 100, seconds,
                wait="", **here,
            ).line()  # fmt: skip
            median, slow, number = map(float, line.split())
            rate = (images.ask() - before) / (time.monotonic() - begin)
            print(
                f"wan, {what}: round trip of a command {median / 1000:.0f} ms, "
                f"95th percentile {slow / 1000:.0f} ms, {number:.0f} trips; "
                f"{rate:.1f} images/s of 25 kB; {link.lost} packets lost so far",
                flush=True,
            )


def robots(number):
    from pipros.fleet.status import directory_of, present
    from pipros.fleet.zenoh_session import connect

    router, half = f"tcp/127.0.0.1:{free_port()}", number // 2

    def until_present(expected):
        """Return the time in seconds until the operator sees exactly `expected` members."""
        begin, number = time.monotonic(), 0
        while time.monotonic() < begin + DEADLINE_S:
            number = len({each.member for each in present(link)}) if link.is_connected else 0
            if number == expected:
                return time.monotonic() - begin
            time.sleep(0.2)
        raise SystemExit(f"{number} of {expected} members are present after {DEADLINE_S} s")

    with contextlib.ExitStack() as stack:
        first = stack.enter_context(contextlib.ExitStack())
        program = pipros(first, "fleet", "router", router, wait="router at")
        begin = time.monotonic()
        parts = [
            worker(stack, "many", router, 0, number - half, wait=""),
            worker(stack, "many", router, number - half, half, wait=""),
        ]
        for part in parts:
            part.line()
        print(f"{number} members joined in {time.monotonic() - begin:.1f} s")
        begin, link = time.monotonic(), connect(router)
        stack.callback(link.close)
        members = {each.member for each in present(link)}
        known = time.monotonic() - begin
        found = [directory_of(link, member) for member in members]
        passed = time.monotonic() - begin
        print(
            f"an operator knows {len(members)} members after {1000 * known:.0f} ms, and "
            f"{sum(each is not None for each in found)} directories, one by one, after {passed:.2f} s"
        )
        print(f"router: {program.usage()[1]:.0f} MB", flush=True)
        if number * TOPICS <= MOST_TOPICS:
            show(router, number)
        first.close()
        begin = time.monotonic()
        pipros(stack, "fleet", "router", router, wait="router at")
        started = time.monotonic() - begin
        passed = started + until_present(number)
        print(f"a new router was started in {started:.1f} s; all were back after {passed:.1f} s", flush=True)
        parts[1].process.send_signal(signal.SIGSTOP)
        gone = until_present(number - half)
        parts[1].process.send_signal(signal.SIGCONT)
        back = until_present(number)
        print(f"{half} stopped members were gone after {gone:.1f} s, and back after {back:.1f} s")


def show(router, number):
    """Measure how long an agent takes to show all topics of the members."""
    from pipros.master.master import Master

    with contextlib.ExitStack() as stack:
        running = stack.enter_context(Master(port=0))
        begin = time.monotonic()
        agent = pipros(
            stack, "fleet", "join", "operator", "--router", router, wait="joined", ROS_MASTER_URI=running.uri
        )
        from xmlrpc.client import ServerProxy

        proxy = ServerProxy(running.uri)
        while time.monotonic() < begin + DEADLINE_S:
            published = proxy.getSystemState("/bench")[2][0]
            if sum(topic.startswith("/robot") for topic, _ in published) == TOPICS * number:
                break
            time.sleep(0.1)
        seconds, megabytes = agent.usage()
        print(
            f"an agent shows {TOPICS * number} topics after {time.monotonic() - begin:.1f} s "
            f"({seconds:.1f} s of processor time): {megabytes:.0f} MB",
            flush=True,
        )


def slow(number, seconds):
    router = f"tcp/127.0.0.1:{free_port()}"
    with contextlib.ExitStack() as stack:
        program = pipros(stack, "fleet", "router", router, wait="router at")
        operator = worker(stack, "watch", router, 0)
        worker(stack, "senders", router, number, 10, 10_000)
        for what in ("alone", "beside a slow operator"):
            if what != "alone":
                other = worker(stack, "watch", router, 10)
                time.sleep(seconds)  # until its buffers are full
                other.ask()
            operator.ask()
            begin = time.monotonic()
            time.sleep(seconds)
            received, delay = operator.ask_all()
            rate = received / (time.monotonic() - begin)
            print(
                f"operator, {what}: {rate:.0f} messages/s, 95th percentile of delays {delay / 1000:.1f} ms",
                flush=True,
            )
        received, delay = other.ask_all()
        print(f"the slow operator: {received / seconds:.0f} messages/s, delay {delay / 1000:.0f} ms")
        print(f"router: {program.usage()[1]:.0f} MB")


def main():
    if sys.argv[1:2] == ["--worker"]:
        name, *arguments = sys.argv[2:]
        WORKERS[name](*(int(each) if each.isdecimal() else each for each in arguments))
        return
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", default="trip,flow,cost,robots,slow")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=int, default=2)
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--quick", action="store_true", help="one round of one second, 20 robots")
    options = parser.parse_args()
    if options.quick:
        options.rounds, options.seconds, options.robots = 1, 1, 20
    wanted = options.only.split(",")
    print(f"load before the run: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    with contextlib.ExitStack() as stack:
        system = System(stack) if {"trip", "flow", "cost"} & set(wanted) else None
        for name, measure, unit, sides in (
            ("trip", trip, "us", ["tcpros", PAUSED, "zenoh", "fleet"]),
            ("flow", flow, "messages/s", ["tcpros", "zenoh", "fleet"]),
        ):
            if name not in wanted:
                continue
            print(f"{name}, {unit:12} " + " ".join(f"{side:>10}" for side in sides))
            for size in SIZES:
                rounds = [
                    [measure(system, side, size, options.seconds) for side in sides]
                    for _ in range(options.rounds)
                ]
                medians = [statistics.median(each) for each in zip(*rounds, strict=True)]
                print(f"{size:>9} B         " + " ".join(f"{each:10.0f}" for each in medians), flush=True)
        if "cost" in wanted:
            cost(system, 5 * options.seconds)
    if "robots" in wanted:
        robots(options.robots)
    if "slow" in wanted:
        slow(min(options.robots, 100), 5 * options.seconds)
    if "wan" in wanted:
        wan(5 * options.seconds)


if __name__ == "__main__":
    main()
