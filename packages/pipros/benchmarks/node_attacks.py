#!/usr/bin/env python3
"""A node's latency for other clients during attacks.

    benchmarks/node_attacks.py [--only NAME,…] [--rounds 3] [--python /usr/bin/python3]

The victim echoes a topic, serves two services, and may have 1,024 descriptors. A bystander in its own
process measures, every few milliseconds, a round trip over existing topic links, `getPid` and a service call,
without an attack and during each attack. This process is the attacker. Of several rounds, the one with the
lowest maximum round trip counts, because other load can only increase the time. The last columns are the
victim's resources at the end of the attack. `--python` is the victim's interpreter; if it has genuine rospy,
genuine rospy is attacked.
"""

import argparse
import contextlib
import os
import resource
import socket
import struct
import subprocess
import sys
import threading
import time

SOURCES = os.path.join(os.path.abspath(os.path.join(__file__, "..", "..", "..", "..")), "build", "src")

if sys.argv[1:] != ["--role", "victim"]:  # the victim's rospy may be genuine
    sys.path.insert(0, SOURCES)
    from pipros.master.master import Master
    from pipros.net.master_client import MasterClient
    from pipros.net.rpc_client import RpcClient
    from pipros.wire.header import HeaderReader, encode_header
    from pipros.wire.http import build_request
    from pipros.wire.xmlrpc import encode_call

AT_LEAST_S = 2.0
GIVE_UP_S = 20.0
MANY = 2_000


# ---- the attacked process, and the bystander


def victim():
    from std_msgs.msg import String
    from std_srvs.srv import Empty, Trigger, TriggerResponse

    import rospy

    resource.setrlimit(resource.RLIMIT_NOFILE, (1024, 1024))
    rospy.init_node("victim", disable_signals=True)
    back = rospy.Publisher("back", String, queue_size=10)
    rospy.Subscriber("forth", String, back.publish, tcp_nodelay=True)
    rospy.Subscriber("listed", String, lambda _: None)
    large = TriggerResponse(success=True, message="x" * 5_000_000)
    rospy.Service("quick", Empty, lambda _: [])
    rospy.Service("large", Trigger, lambda _: large)
    print(os.getpid(), flush=True)
    sys.stdin.read()
    os._exit(0)


def bystander():
    """Measure until a line arrives. Print the count, the maximum of each time in ms, and the failures."""
    from std_msgs.msg import String
    from std_srvs.srv import Empty

    import rospy

    rospy.init_node("bystander", disable_signals=True)
    end, returned = threading.Event(), threading.Event()
    threading.Thread(target=lambda: (sys.stdin.readline(), end.set()), daemon=True).start()
    forth = rospy.Publisher("forth", String, queue_size=10)
    rospy.Subscriber("back", String, lambda _: returned.set(), tcp_nodelay=True)
    quick = rospy.ServiceProxy("quick", Empty)
    rospy.wait_for_service("quick")
    api = RpcClient(MasterClient(os.environ["ROS_MASTER_URI"], "/bystander").lookup_node("/victim"))

    def trip():
        returned.clear()
        forth.publish("hello")
        if not returned.wait(GIVE_UP_S):
            raise TimeoutError

    while not returned.is_set():
        forth.publish("hello")
        returned.wait(0.1)
    time.sleep(0.3)
    took = {"trip": [], "getPid": [], "call": []}
    failed = dict.fromkeys(took, 0)
    asks = {"trip": trip, "getPid": lambda: api.call("getPid", "/b", timeout_s=GIVE_UP_S), "call": quick}
    print("measuring", flush=True)
    while not end.wait(0.002):
        for name, ask in asks.items():
            began = time.perf_counter()
            try:
                ask()
            except Exception:
                failed[name] += 1
            took[name].append((time.perf_counter() - began) * 1e3)
    print(
        len(took["trip"]), *(f"{max(values):.1f}" for values in took.values()), *failed.values(), flush=True
    )
    os._exit(0)


def late():
    """Subscribe for the first time. Print the time until a message arrived, in ms."""
    from std_msgs.msg import String

    import rospy

    rospy.init_node("late", disable_signals=True)
    came = threading.Event()
    began = time.perf_counter()
    rospy.Subscriber("back", String, lambda _: came.set())
    print(f"{(time.perf_counter() - began) * 1e3:.0f}" if came.wait(GIVE_UP_S) else "never", flush=True)
    os._exit(0)


class Victim:
    """The attacked node's addresses."""

    def __init__(self, master, pid):
        client = MasterClient(master.uri, "/attacker")
        self.uri = client.lookup_node("/victim")
        self.pid = pid
        self.api_port = int(self.uri.rpartition(":")[2].strip("/"))
        self.tcpros_port = int(client.lookup_service("/quick").rpartition(":")[2])
        self.held = []

    def connect(self, port=None):
        peer = socket.socket()
        peer.settimeout(5)
        self.held.append(peer)
        with contextlib.suppress(OSError):
            peer.connect(("127.0.0.1", port or self.tcpros_port))
        return peer

    def send(self, peer, data):
        with contextlib.suppress(OSError):
            peer.sendall(data)
        return peer

    def greet(self, fields, then=b""):
        """Open a connection, exchange headers if the victim responds, and send the given bytes."""
        peer = self.send(self.connect(), encode_header({"md5sum": "*", "callerid": "/attacker", **fields}))
        reader = HeaderReader()
        with contextlib.suppress(OSError):
            while (data := peer.recv(1)) and reader.feed(data) is None:
                pass
        return self.send(peer, then)

    def state(self):
        with open(f"/proc/{self.pid}/status") as file:
            fields = dict(line.split(":", 1) for line in file)
        with contextlib.suppress(PermissionError):
            descriptors = len(os.listdir(f"/proc/{self.pid}/fd"))
        return int(fields["Threads"]), descriptors, int(fields["VmRSS"].split()[0]) // 1024


# ---- attacks


def no_attack(_victim):
    pass


def connections_without_a_header(victim):
    for _ in range(MANY):
        victim.connect()


def half_headers(victim):
    for _ in range(MANY):
        victim.send(victim.connect(), b"\xff\xff\x00\x00\x10\x00")


def headers_byte_by_byte(victim):
    peers = [victim.connect() for _ in range(100)]
    header = encode_header({"topic": "/back", "md5sum": "*", "callerid": "/slow" + "w" * 200})
    for byte in header:
        for peer in peers:
            victim.send(peer, bytes([byte]))


def idle_service_clients(victim):
    for _ in range(MANY):
        victim.greet({"service": "/quick"})


def idle_persistent_clients(victim):
    for _ in range(MANY):
        victim.greet({"service": "/quick", "persistent": "1"})


def half_requests(victim):
    for _ in range(MANY):
        victim.greet({"service": "/quick"}, struct.pack("<IB", 1000, 0))


def requests_byte_by_byte(victim):
    peers = [victim.greet({"service": "/quick"}, struct.pack("<I", 1000)) for _ in range(50)]
    for _ in range(200):
        for peer in peers:
            victim.send(peer, b"x")


def responses_not_read(victim):
    for _ in range(50):
        victim.greet({"service": "/large"}, struct.pack("<I", 0))


def rapid_calls(victim):
    end = time.monotonic() + AT_LEAST_S
    while time.monotonic() < end:
        victim.greet({"service": "/quick"}, struct.pack("<I", 0)).close()


def topic_links(victim):
    for _ in range(MANY):
        victim.greet({"topic": "/back"})


def links_that_do_not_read(victim):
    for _ in range(200):
        peer = victim.greet({"topic": "/back"})
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)


def garbage(victim):
    for seed in range(500):
        peer = victim.send(victim.connect(), bytes((seed * 7 + at * at) % 256 for at in range(2000)))
        peer.close()


def idle_connections_to_the_slave_api(victim):
    for _ in range(MANY):
        victim.connect(victim.api_port)


def half_requests_to_the_slave_api(victim):
    for _ in range(MANY):
        victim.send(victim.connect(victim.api_port), b"POST / HTTP/1.1\r\nContent-Length: 100\r\n\r\n<")


def large_bodies(victim):
    part = b"POST / HTTP/1.1\r\nContent-Length: 16000000\r\n\r\n" + b"x" * 15_000_000
    for _ in range(30):
        victim.send(victim.connect(victim.api_port), part)


def large_values(victim):
    document = build_request("h", "/", encode_call("paramUpdate", ("/a", "/b", [[1, "x"]] * 100_000)))
    for _ in range(10):
        victim.send(victim.connect(victim.api_port), document)


def update(victim, uris):
    with RpcClient(victim.uri) as api, contextlib.suppress(Exception):
        api.call("publisherUpdate", "/master", "/listed", uris, timeout_s=GIVE_UP_S)


def dead_publishers(victim):
    update(victim, [f"http://127.0.0.1:1/{number}" for number in range(10_000)])


def silent_publishers(victim):
    listener = socket.create_server(("127.0.0.1", 0), backlog=1000)
    victim.held.append(listener)
    update(victim, [f"http://127.0.0.1:{listener.getsockname()[1]}/{number}" for number in range(1_000)])


ATTACKS = {
    function.__name__.replace("_", " "): function
    for function in (
        *(no_attack, connections_without_a_header, half_headers, headers_byte_by_byte, idle_service_clients),
        *(idle_persistent_clients, half_requests, requests_byte_by_byte, responses_not_read, rapid_calls),
        *(topic_links, links_that_do_not_read, garbage, idle_connections_to_the_slave_api),
        *(half_requests_to_the_slave_api, large_bodies, large_values, dead_publishers, silent_publishers),
    )
}


# ---- the driver


def start(python, role, master):
    environment = {**os.environ, "ROS_MASTER_URI": master.uri, "ROS_IP": "127.0.0.1"}
    return subprocess.Popen(
        [python, os.path.abspath(__file__), "--role", role],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def attacked(python, attack):
    with Master(port=0) as master:
        attacked_node = start(python, "victim", master)
        try:
            target = Victim(master, int(attacked_node.stdout.readline()))
            looking_on = start(sys.executable, "bystander", master)
            looking_on.stdout.readline()
            began = time.monotonic()
            attacking = threading.Thread(target=attack, args=(target,), daemon=True)
            attacking.start()
            attacking.join(GIVE_UP_S)
            time.sleep(max(0.3, AT_LEAST_S - (time.monotonic() - began)))
            state = target.state()
            newcomer = start(sys.executable, "late", master)
            came = newcomer.communicate()[0].strip()
            said = looking_on.communicate("end\n")[0].split()
            for peer in target.held:
                peer.close()
        finally:
            attacked_node.kill()
            attacked_node.communicate()
    return said, came, state


def main():
    if sys.argv[1:2] == ["--role"]:
        {"victim": victim, "bystander": bystander, "late": late}[sys.argv[2]]()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", help="some of: " + ", ".join(ATTACKS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--python", default=sys.executable, help="the victim's Python")
    options = parser.parse_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 65536), hard))
    print(
        "| while | measured | longest trip, ms | getPid, ms | call, ms | failed | late subscriber, ms",
        end=" ",
    )
    print("| threads | descriptors | MB |\n| --- |" + " ---: |" * 9)
    for name in options.only.split(",") if options.only else ATTACKS:
        rounds = [attacked(options.python, ATTACKS[name]) for _ in range(options.rounds)]
        said, came, state = min(rounds, key=lambda found: float(found[0][1]))
        count, *longest, _, _, _ = said
        failed = sum(map(int, said[4:]))
        print(
            f"| {name} | {' | '.join([count, *longest, str(failed), came, *map(str, state)])} |", flush=True
        )


if __name__ == "__main__":
    main()
