#!/usr/bin/env python3
"""What the gateway costs with each engine, and what arrives: pipros's own for DDS, and rclpy.

    script/bench engines [--distro jazzy] [--seconds 8]

A ROS 1 node and a node of genuine rclpy publish to each other through the gateway: texts of 1 kB at 200 Hz,
then of 1 MB at 20 Hz. Processor time and memory are those of the gateway and of rclpy's process together;
memory is what is not shared with others (USS). The benchmark runs in its own network, so it needs root.
"""

import subprocess
import sys
import time

import psutil
from programs import Programs
from ros2 import in_own_network
from table import heed_interrupts, options_of

from tests.support.waiting import wait_until

LOADS = {"1 kB at 200 Hz": (1_000, 200), "1 MB at 20 Hz": (1_000_000, 20)}
PEER = """
import rclpy, sys, threading, time
from rclpy.qos import QoSProfile
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("peer")
arrived = 0
def take(message):
    global arrived
    arrived += 1
qos = QoSProfile(depth=1000)
node.create_subscription(String, "/to_ros2", take, qos)
publisher = node.create_publisher(String, "/to_ros1", qos)
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
while not publisher.get_subscription_count() or not node.count_publishers("/to_ros2"):
    time.sleep(0.1)
print("ready", flush=True)
for line in sys.stdin:
    size, rate, count = map(int, line.split())
    message, began = String(data="x" * size), time.monotonic()
    for number in range(count):
        time.sleep(max(0, began + number / rate - time.monotonic()))
        publisher.publish(message)
    last = -1
    while arrived != last and arrived < count:
        last = arrived
        time.sleep(3)
    print(arrived, flush=True)
    arrived = 0
"""


def cost(process):
    """Return the processor time and the memory of a process and its children, in seconds and MB."""
    found = [process, *process.children(recursive=True)]
    return (
        sum(sum(each.cpu_times()[:2]) for each in found),
        sum(each.memory_full_info().uss for each in found) / 1e6,
    )


def measure(distro, seconds, engine):
    """Yield the rows of an engine."""
    from pipros.msg import load_message_class
    from tests.support.ros2_wheels import environment

    text = load_message_class("std_msgs/String")
    python = str(environment(distro) / "bin" / "python")
    words = [] if engine == "dds" else ["--ros2-python", python]
    arrived = []
    with Programs() as programs:
        programs.environment |= {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
        node = programs.node()
        publisher = node.advertise("/to_ros2", text, queue_size=0)
        node.subscribe("/to_ros1", text, lambda _: arrived.append(1))
        gateway = programs.start("pipros", "ros2", "--distro", distro, *words, stdout=subprocess.PIPE)
        gateway.stdout.readline()
        process = psutil.Process(gateway.pid)
        time.sleep(2)
        spent, memory = cost(process)
        yield engine, "start", "", f"{spent:.1f} s", f"{memory:.0f} MB"
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        peer = programs.start(python, "-c", PEER, **pipes)
        assert peer.stdout.readline() == "ready\n"
        wait_until(lambda: publisher.connection_count)
        for load, (size, rate) in LOADS.items():
            count = seconds * rate
            arrived.clear()
            before = cost(process)[0]
            peer.stdin.write(f"{size} {rate} {count}\n")
            peer.stdin.flush()
            message, began = text("x" * size), time.monotonic()
            for number in range(count):
                time.sleep(max(0, began + number / rate - time.monotonic()))
                publisher.publish(message)
            there = int(peer.stdout.readline())
            spent, memory = cost(process)
            figures = f"{there} and {len(arrived)} of {count}"
            yield engine, load, figures, f"{spent - before:.1f} s", f"{memory:.0f} MB"


def main():
    options = options_of(__doc__, distro="jazzy", seconds=8, inside=False)
    heed_interrupts()

    def work():
        print(
            "| engine | load | arrived in ROS 2 and ROS 1 | processor time | memory |\n" + "| --- " * 5 + "|"
        )
        for engine in ("dds", "rclpy"):
            for row in measure(options.distro, options.seconds, engine):
                print("| " + " | ".join(row) + " |", flush=True)
        return 0

    return in_own_network(options, work)


if __name__ == "__main__":
    sys.exit(main())
