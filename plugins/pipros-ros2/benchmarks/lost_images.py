#!/usr/bin/env python3
"""How many large messages reach genuine rclpy if datagrams are lost, from both engines and from rclpy.

    script/bench lost_images [--distros jazzy,kilted] [--count 200]

Each cell starts a subscriber and a publisher in a network of their own, over UDP, both reliable. The
publisher loses a share of its datagrams of more than 1,200 bytes. It publishes messages of 1 MB, faster than
rclpy takes them in half of the cells, and then short ones. The benchmark fails if a subscriber does not take
the short ones or does not end after Ctrl-C.
"""

import itertools
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from table import heed_interrupts, options_of
from wire import losing

BYTES = 1_000_000
LISTENER = """
import rclpy, sys
from rclpy.qos import QoSProfile
from std_msgs.msg import String

def take(message):
    global arrived
    if len(message.data) > 1000:
        arrived += 1
    elif arrived >= 0:
        print("arrived", arrived, flush=True)
        arrived = -1

arrived = 0
rclpy.init()
node = rclpy.create_node("listener")
subscription = node.create_subscription(String, "/texts", take, QoSProfile(depth=int(sys.argv[1])))
print("ready", flush=True)
rclpy.spin(node)
"""
GENUINE = """
import rclpy
from rclpy.qos import QoSProfile
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(String, "/texts", QoSProfile(depth=depth))
subscribers = publisher.get_subscription_count
def publish(size):
    publisher.publish(String(data="x" * size))
"""
ENGINE = """
import struct
from pipros_ros2.agent.engine import RclpyEngine
from pipros_ros2.interface import TopicQos
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine
engine = CREATE(Discovery(0), "/talker")
publisher = engine.advertise("/texts", "std_msgs/msg/String", "", TopicQos(depth=depth))
def subscribers():
    return publisher.subscriber_count
def publish(size):
    publisher.publish(struct.pack("<HHI", 0x0100, 0, size + 1) + b"x" * size + bytes(1))
"""
SENDERS = {
    "pipros": ENGINE.replace("CREATE(", "RtpsEngine("),
    "engine rclpy": ENGINE.replace("CREATE(", "RclpyEngine(python=sys.argv.pop(), discovery=").replace(
        '"/talker"', 'node="/talker"'
    ),
    "rclpy": GENUINE,
}
TALKER = """
import itertools, sys, time
depth, rate, count, size = map(int, sys.argv[1:5])
{connect}
while not subscribers():
    time.sleep(0.02)
began = time.monotonic()
for number in range(count):
    time.sleep(max(0, began + number / rate - time.monotonic()))
    publish(size)
for _ in itertools.count():
    publish(1)
    time.sleep(0.1)
"""


def arrived(distro, sender, depth, rate, loss, count, folder):
    """Return how many large messages arrive; -1 if the subscriber hangs."""
    from tests.support.dds_peers import enable_multicast
    from tests.support.network import LoneNetwork
    from tests.support.processes import Processes
    from tests.support.ros2_wheels import environment

    python = str(environment(distro) / "bin" / "python")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "ROS_"))}
    own = {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4", "ROS_LOG_DIR": str(folder)}
    processes, network = Processes({**kept, **own}, folder), LoneNetwork("127.0.0.1 localhost\n")
    try:
        enable_multicast(network)
        listener = processes.start(*network.command(python, "-c", LISTENER, str(depth)))
        listener.wait_for("^ready$")
        interpreter = python if sender == "rclpy" else sys.executable
        words = [interpreter, "-c", TALKER.format(connect=SENDERS[sender])]
        words += [*map(str, (depth, rate, count, BYTES)), *([python] if sender == "engine rclpy" else [])]
        talker = processes.start(*network.command(*words), environment=losing(folder, loss))
        try:
            found = int(listener.wait_for("^arrived (.*)$", 60)[1])
            listener.press_ctrl_c()
            listener.wait()
        except (AssertionError, subprocess.TimeoutExpired):
            assert talker.is_running, talker.output
            return -1
        return found
    finally:
        processes.end_all()
        network.close()


def main():
    options = options_of(__doc__, distros="jazzy,kilted", count=200)
    heed_interrupts()
    hangs = 0
    print(f"| rclpy | lost | depth | Hz | {': arrived | '.join(SENDERS)}: arrived |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        cells = itertools.product(options.distros.split(","), (0.03, 0.05), (5, 10), (50, 200))
        for distro, loss, depth, rate in cells:
            found = [
                arrived(distro, sender, depth, rate, loss, options.count, Path(name)) for sender in SENDERS
            ]
            hangs += found.count(-1)
            shares = ["hangs" if each < 0 else f"{100 * each / options.count:.0f} %" for each in found]
            print(f"| {distro} | {100 * loss:.0f} % | {depth} | {rate} | {' | '.join(shares)} |", flush=True)
    return hangs > 0


if __name__ == "__main__":
    sys.exit(main())
