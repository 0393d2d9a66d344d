"""A navigation node that a benchmark feeds, its processor time, and recorded results of genuine nodes."""

import gzip
import json
import os
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "build"))

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.simulation.robots.drive import Pose
from tests.support.drives import scan_message, transform_message
from tests.support.environments import make_tool_folder
from tests.support.nodes import Inbox
from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

RECORDED = Path(__file__).parent / "recorded"
TICKS = os.sysconf("SC_CLK_TCK")
MAPPING_START = Pose(2.9, 1.0, 0.0)
MAPPING = {
    "xmin": -8.0, "ymin": -8.0, "xmax": 12.0, "ymax": 12.0, "linearUpdate": 0.0, "angularUpdate": 0.0,
    "map_update_interval": 0.0, "particles": 15, "srr": 0.05, "srt": 0.05, "str": 0.05, "stt": 0.05,
    "seed": 1,
}  # fmt: skip


def recorded(name):
    """Return the content of a file in benchmarks/recorded."""
    return json.loads(gzip.decompress((RECORDED / f"{name}.json.gz").read_bytes()))


def used_s(process):
    """Return the processor time of a process and those that it has started, in seconds."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = file.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if int(fields[3]) == process.pid:  # its session
            total += int(fields[11]) + int(fields[12])
    return total / TICKS


class Bench:
    """A node of pipros with the name `tested`, and a node that feeds it."""

    def __init__(self, ros):
        ros.serve_master()
        self._ros = ros
        self.node = Node("bench", environment=Environment(master_uri=ros.master_uri))
        self._publishers = {}
        self._subscribed = set()

    def start(self, package, program, parameters):
        self.node.params.set("/tested", parameters)
        self._process = self._ros.pipros.start("rosrun", package, program, "__name:=tested")

    def publish(self, topic, message, *, waits=True):
        """Publish a message, as soon as the node has subscribed to the topic if `waits`."""
        if topic not in self._publishers:
            is_latched = topic in ("/tf_static", "/map")
            made = self.node.advertise(topic, type(message), queue_size=100, latch=is_latched)
            self._publishers[topic] = made
            is_own = topic in self._subscribed
            if waits:
                self.wait(lambda: made.connection_count > is_own, f"the subscription to {topic}")
        self._publishers[topic].publish(message)

    def subscribe(self, topic, kind):
        inbox = Inbox()
        self._subscribed.add(topic)
        self.node.subscribe(topic, load_message_class(kind), inbox)
        return inbox

    def wait(self, condition, what):
        wait_until(condition, 60, lambda: f"{what}: {self._process.output}")

    @contextmanager
    def measured(self):
        """Measure the processor time of the node during a context."""
        before = used_s(self._process)
        yield
        self.used_s = used_s(self._process) - before


@contextmanager
def running():
    """Yield a bench with its own master, port and folder."""
    with tempfile.TemporaryDirectory() as folder:
        port, home = ClaimedPort(), Path(folder) / "home"
        home.mkdir()
        ros = RosSystem(port.number, home, make_tool_folder(Path(folder) / "bin"))
        try:
            bench = Bench(ros)
            with bench.node:
                yield bench
        finally:
            ros.close()
            port.release()


def drawn(bench, moments, parameters):
    """Return the maps that slam_gmapping draws during a drive: one after each scan."""
    bench.start("gmapping", "slam_gmapping", parameters)
    maps = bench.subscribe("/map", "nav_msgs/OccupancyGrid")
    bench.publish("/tf_static", transform_message("base_link", "laser", Pose(), 0.0))
    with bench.measured():
        for count, moment in enumerate(moments, 1):
            bench.publish("/tf", transform_message("odom", "base_link", moment.odometry, moment.time_s))
            bench.publish("/scan", scan_message(moment))
            bench.wait(lambda: len(maps.messages) >= count, "a map")  # noqa: B023
    return maps.messages
