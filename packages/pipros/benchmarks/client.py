#!/usr/bin/env python3
"""Throughput and latency of rospy: pipros and genuine rospy, in one run.

    script/bench client [--only flow,trip] [--rounds 3] [--seconds 2] [--quick]

"tuned" is genuine rospy with an allocator that keeps freed memory. "roscpp" is the same workload in C++
(benchmarks/roscpp), if it has an equivalent. The ratio is the factor by which pipros is better. A "window"
limits the number of messages in transit, to measure the sustained rate without loss. Nothing else should be
running; the load from other programs is printed.
"""

import functools
import gc
import signal
import statistics
import sys
import threading
import time
import xmlrpc.client

from worlds import answer, compare, finish, imported_ms, init, message, one_process, open_worlds, say

WARM_UP = 5  # messages before the measured ones; both numbers are the same in roscpp/src/client.cpp
SETTLE_S = 1.0  # before the last of these: what nodes still do after their start does not belong to messages

# ---- workers: in their own processes, with the public rospy API only


def worker_source(kind, queue, window, seconds, peers, rate_hz=0):
    """Publish for a while, at full speed if the rate is 0, then print the number of calls."""
    rospy = init("source")
    from std_msgs.msg import Empty, Int32

    msg, acked, more = message(kind), [0], threading.Event()
    publisher = rospy.Publisher("flow", type(msg), queue_size=queue)
    end = rospy.Publisher("end", Empty, queue_size=1, latch=True)

    def on_ack(ack):
        acked[0] = ack.data
        more.set()

    rospy.Subscriber("ack", Int32, on_ack, tcp_nodelay=True)
    while publisher.get_num_connections() < peers or end.get_num_connections() < peers:
        time.sleep(0.01)
    for number in range(WARM_UP):
        time.sleep(SETTLE_S if number == WARM_UP - 1 else 0.02)
        publisher.publish(msg)
    sent, began, cpu = WARM_UP, time.monotonic(), time.process_time()
    while time.monotonic() < began + seconds:
        count = min(10, window - (sent - acked[0])) if window else 10
        if rate_hz:
            count = 1
            time.sleep(max(0.0, began + (sent - WARM_UP) / rate_hz - time.monotonic()))
        elif count <= 0:
            more.clear()
            if window - (sent - acked[0]) <= 0:
                more.wait(0.2)
            continue
        for _ in range(count):
            publisher.publish(msg)
        sent += count
    cpu = time.process_time() - cpu
    end.publish()
    time.sleep(1.0)
    say(sent=sent - WARM_UP, cpu=cpu)


def worker_sink(kind, window):
    """Count messages until the source announces its end."""
    rospy = init("sink")
    from std_msgs.msg import Empty, Int32

    seen, first, last, cpu, ended = [0], [0.0], [0.0], [0.0], threading.Event()
    ack = rospy.Publisher("ack", Int32, queue_size=10)
    step = max(1, window // 4)

    def on_message(_):
        now = time.monotonic()
        seen[0] += 1
        if seen[0] == WARM_UP:
            first[0], cpu[0] = now, time.process_time()
        last[0] = now
        if window and seen[0] % step == 0:
            ack.publish(seen[0])

    rospy.Subscriber("end", Empty, lambda _: ended.set())
    rospy.Subscriber("flow", type(message(kind)), on_message)
    ended.wait()
    count = -1
    while count != seen[0]:
        count = seen[0]
        time.sleep(0.2)
    cpu = time.process_time() - cpu[0]
    seen = seen[0] - WARM_UP
    say(seen=seen, rate=seen / max(last[0] - first[0], 1e-9), cpu=cpu)


def worker_echo(kind, queue):
    rospy = init("echo")
    msg = message(kind)
    back = rospy.Publisher("back", type(msg), queue_size=queue)
    rospy.Subscriber("forth", type(msg), back.publish, tcp_nodelay=True)
    sys.stdin.read()


def worker_trip(kind, queue, seconds):
    """Send messages on a round trip, each after the previous one has returned. Print the median time."""
    rospy = init("trip")
    msg, returned, times = message(kind), threading.Event(), []
    publisher = rospy.Publisher("forth", type(msg), queue_size=queue)
    rospy.Subscriber("back", type(msg), lambda _: returned.set(), tcp_nodelay=True)
    while not returned.is_set():
        publisher.publish(msg)
        returned.wait(0.1)
    time.sleep(0.3)
    stop = time.monotonic() + seconds
    while time.monotonic() < stop:
        returned.clear()
        began = time.perf_counter()
        publisher.publish(msg)
        returned.wait(1)
        times.append(time.perf_counter() - began)
    say(median=statistics.median(times))


def worker_map(megabytes):
    """Publish a latched map, as a list of numbers."""
    rospy = init("map")
    from nav_msgs.msg import OccupancyGrid

    publisher = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
    publisher.publish(OccupancyGrid(data=[0] * (megabytes << 20)))
    gc.freeze()  # a garbage collection would take a second, because it visits every number in the list
    say(uri=rospy.get_node_uri())
    sys.stdin.read()


def worker_late():
    """Subscribe to the map, and exit when it has arrived."""
    rospy = init("late")
    arrived = threading.Event()
    rospy.Subscriber("map", rospy.AnyMsg, lambda _: arrived.set())
    arrived.wait()
    say(arrived=True)


def worker_server():
    rospy = init("server")
    from std_srvs.srv import Empty

    rospy.Service("empty", Empty, lambda _: [])
    say(ready=True)
    sys.stdin.read()


def worker_caller(persistent, seconds):
    rospy = init("caller")
    from std_srvs.srv import Empty

    rospy.wait_for_service("empty")
    proxy, times = rospy.ServiceProxy("empty", Empty, persistent=persistent), []
    proxy()
    stop = time.monotonic() + seconds
    while time.monotonic() < stop:
        began = time.perf_counter()
        proxy()
        times.append(time.perf_counter() - began)
    say(median=statistics.median(times))


def worker_many():
    """Publish and subscribe to 200 topics in one process."""
    rospy = init("many")
    from std_msgs.msg import String

    publishers = [rospy.Publisher(f"topic_{n}", String, queue_size=1) for n in range(200)]
    for n in range(200):
        rospy.Subscriber(f"topic_{n}", String, lambda _: None)
    while not all(publisher.get_num_connections() for publisher in publishers):
        time.sleep(0.05)
    time.sleep(0.5)
    say(**status())


def worker_start():
    import rospy

    began = time.perf_counter()
    rospy.init_node("start", anonymous=True)
    say(initialised=time.perf_counter() - began)


def worker_talker():
    from std_msgs.msg import String

    import rospy

    rospy.init_node("talker")
    publisher = rospy.Publisher("chat", String, queue_size=10)
    rate, said = rospy.Rate(10), False
    while not rospy.is_shutdown():
        publisher.publish("hello")
        if not said:
            said = True
            say(**status())
        rate.sleep()


def status():
    with open("/proc/self/status") as file:
        fields = dict(line.split(":", 1) for line in file)
    return {"threads": int(fields["Threads"]), "mb": int(fields["VmRSS"].split()[0]) / 1024}


# ---- the driver


def flow(kind, queue, window, world, seconds, peers=1, rate_hz=0):
    """Return what the publisher and each subscriber print: messages, and processor time in s."""
    sinks = [world.work("sink", kind, window) for _ in range(peers)]
    source = world.work("source", kind, queue, window, seconds, peers, rate_hz)
    found = answer(source), [answer(sink) for sink in sinks]
    finish(source, *sinks)
    return found


def one_to_one(label, kind, queue, window, world, seconds):
    return {f"{label}: messages/s": flow(kind, queue, window, world, seconds)[1][0]["rate"]}


def fan(queue, world, seconds):
    label = f"1 to 10 processes, 16 B, queue_size={queue}"
    published, received = flow("string", queue, 0, world, seconds, peers=10)
    used_us = published["cpu"] / published["sent"] * 1e6
    return {
        f"{label}: messages/s": sum(each["rate"] for each in received),
        f"{label}: us of the publisher's processor time per message": used_us,
    }


def trip(label, kind, queue, world, seconds):
    echo, measuring = world.work("echo", kind, queue), world.work("trip", kind, queue, seconds)
    median = answer(measuring)["median"]
    finish(measuring, echo)
    return {f"round trip {label}, queue_size={queue}: us": median * 1e6}


def service(label, persistent, world, seconds):
    server = world.work("server")
    answer(server)
    caller = world.work("caller", persistent, seconds)
    median = answer(caller)["median"]
    finish(caller, server)
    return {f"service call{label}: us": median * 1e6}


def control(world, _seconds, megabytes=100, peers=3):
    """Measure the longest slave API call while subscribers connect and receive a latched map."""
    server = world.work("map", megabytes)
    uri, longest = answer(server)["uri"], 0.0
    late = [world.work("late") for _ in range(peers)]
    waiting = [threading.Thread(target=answer, args=(process,), daemon=True) for process in late]
    for thread in waiting:
        thread.start()
    while any(thread.is_alive() for thread in waiting):
        began = time.perf_counter()
        with xmlrpc.client.ServerProxy(uri) as node:
            node.requestTopic("/benchmark", "/map", [["TCPROS"]])
        longest = max(longest, time.perf_counter() - began)
        time.sleep(0.01)
    finish(server, *late)
    label = f"requestTopic while {peers} nodes subscribe to a latched {megabytes} MB map, longest call: ms"
    return {label: longest * 1e3}


def many(world, _seconds):
    found = one_process(world, __file__, "many")
    label = "200 topics published and received by one node"
    return {f"{label}: threads": found["threads"], f"{label}: MB": found["mb"]}


def init_node(world, _seconds):
    return {"init_node: ms": one_process(world, __file__, "start")["initialised"] * 1e3}


def import_rospy(world, _seconds):
    return {"import rospy, whole process: ms": imported_ms(world, "rospy")}


def leave(world, _seconds):
    """Measure the time from Ctrl-C to the end of a talker's process, and its memory."""
    talker = world.work("talker")
    megabytes = answer(talker)["mb"]
    time.sleep(0.35)
    began = time.perf_counter()
    talker.send_signal(signal.SIGINT)
    talker.wait()
    took = time.perf_counter() - began
    finish(talker)
    return {"exit of a node after Ctrl-C: ms": took * 1e3, "resident memory of a talker: MB": megabytes}


FLOWS = (
    ("String 16 B, queue_size=1000, window 500", "string", 1000, 500),
    ("Imu, queue_size=1000, window 500", "imu", 1000, 500),
    ("String 16 B, queue_size=None", "string", None, 0),
    ("Imu, queue_size=None", "imu", None, 0),
    ("Image 1 MB, queue_size=50, window 8", "image", 50, 8),
    ("Image 1 MB, queue_size=None", "image", None, 0),
    ("PointCloud2 4 MB, queue_size=None", "cloud", None, 0),
)
TRIPS = (("16 B", "string", 10), ("16 B", "string", None), ("1 MB", "image", 10))
WORKLOADS = {
    **{f"flow {each[0]}": functools.partial(one_to_one, *each) for each in FLOWS},
    **{f"trip {each[0]} {each[2]}": functools.partial(trip, *each) for each in TRIPS},
    **{f"fan {queue}": functools.partial(fan, queue) for queue in (None, 1000)},
    "service": functools.partial(service, "", False),
    "service, persistent": functools.partial(service, ", persistent", True),
    "control": control,
    "many": many,
    "start init_node": init_node,
    "start import": import_rospy,
    "start exit": leave,
}
QUICK = (
    f"flow {FLOWS[0][0]}", f"flow {FLOWS[4][0]}", "trip 16 B 10", "service", "start init_node", "start import"
)  # fmt: skip


if __name__ == "__main__":
    compare(__doc__, WORKLOADS, globals(), opened=open_worlds(roscpp=True), quick=QUICK)
