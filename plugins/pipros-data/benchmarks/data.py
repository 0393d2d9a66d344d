"""Time to make tables from bags.

    script/bench data [--count 20000] [--rounds 5]

Writes one bag with messages of four types, and reads each topic by turns: as a table
(`pipros_data`), with `rosbag.Bag.read_messages(raw=True)`, in a loop that decodes with rosbags, and as a
pandas dataframe with `pipros_data` and with rosbags-dataframe. Needs rosbags-dataframe and pandas.
Prints the medians of the rounds. Processor time of this process counts, so that other work disturbs little.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from geometry_msgs.msg import TransformStamped
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import Imu, JointState, LaserScan
from table import line, options_of
from tf2_msgs.msg import TFMessage

import rosbag
import rospy
from pipros_data import open_bags

TOPICS = {
    "/imu": [f"orientation.{axis}" for axis in "xyzw"]
    + [f"{field}.{axis}" for field in ("angular_velocity", "linear_acceleration") for axis in "xyz"],
    "/joint_states": ["name", "position", "velocity", "effort"],
    "/scan": ["angle_min", "angle_max", "range_min", "range_max", "ranges", "intensities"],
    "/tf": ["transforms"],
}
"""The fields requested from rosbags-dataframe."""


def write_bag(path: Path, count: int) -> None:
    with rosbag.Bag(str(path), "w") as bag:
        for n in range(count):
            stamp = rospy.Time(1000 + n // 100, n % 100 * 10_000_000)
            imu = Imu()
            joints = JointState(
                name=[f"joint_{joint}" for joint in range(1, 8)],
                position=[float(n)] * 7,
                velocity=[0.5] * 7,
                effort=[1.0] * 7,
            )
            scan = LaserScan(ranges=[float(n)] * 360, intensities=[1.0] * 360)
            transforms = [TransformStamped(child_frame_id=f"link_{link}") for link in range(1 + n % 5)]
            for message in (imu, joints, scan, *transforms):
                message.header.frame_id, message.header.stamp = "base_link", stamp
            bag.write("/imu", imu, stamp)
            bag.write("/joint_states", joints, stamp)
            bag.write("/tf", TFMessage(transforms), stamp)
            if n % 4 == 0:
                bag.write("/scan", scan, stamp)


def as_table(path: Path, topic: str) -> int:
    with open_bags(path) as bags:
        return bags.table(topic).rows


def raw(path: Path, topic: str) -> int:
    with rosbag.Bag(str(path)) as bag:
        return sum(1 for _ in bag.read_messages(topic, raw=True))


def with_rosbags(path: Path, topic: str) -> int:
    store = get_typestore(Stores.EMPTY)
    count = 0
    with Reader(path) as reader:
        wanted = [each for each in reader.connections if each.topic == topic]
        for connection in wanted:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, _, data in reader.messages(wanted):
            store.deserialize_ros1(data, connection.msgtype)
            count += 1
    return count


def as_dataframe(path: Path, topic: str) -> int:
    with open_bags(path) as bags:
        return len(bags.table(topic).to_pandas())


def with_rosbags_dataframe(path: Path, topic: str) -> int:
    from rosbags.dataframe import get_dataframe  # which not all parts need

    with AnyReader([path]) as reader:
        return len(get_dataframe(reader, topic, TOPICS[topic]))


READERS = (as_table, raw, with_rosbags, as_dataframe, with_rosbags_dataframe)
HEADS = """topic|messages|table|raw read|rosbags|to pandas|rosbags-dataframe|table : raw read|rosbags : table
rosbags-dataframe : table|rosbags-dataframe : pandas""".replace("\n", "|").split("|")


def main() -> None:
    arguments = options_of(__doc__, count=20_000, rounds=5)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.bag"
        write_bag(path, arguments.count)
        print(f"{line(HEADS)}\n{line(['---', *['---:'] * 10])}")
        for topic in TOPICS:
            times: dict[Any, list[float]] = {each: [] for each in READERS}
            counts = set()
            for round_number in range(arguments.rounds + 1):
                for read, values in times.items():
                    start = time.process_time()
                    counts.add(read(path, topic))
                    if round_number:  # the first round imports modules
                        values.append(time.process_time() - start)
            assert len(counts) == 1, counts
            found = [statistics.median(values) for values in times.values()]
            ours, plain, theirs, pandas, others = found
            ratios = (ours / plain, theirs / ours, others / ours, others / pandas)
            cells = (f"`{topic}`", f"{counts.pop():,}", *(f"{1000 * each:.0f} ms" for each in found))
            print(line([*cells, *(f"{each:.3g}" for each in ratios)]))


if __name__ == "__main__":
    main()
