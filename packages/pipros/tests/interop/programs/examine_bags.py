"""Write random bags, and print everything that rosbag reports about bags; for both implementations.

python examine_bags.py write FOLDER SEED COUNT     python examine_bags.py read FILE...
"""

import hashlib
import json
import random
import sys

from geometry_msgs.msg import Pose, PoseArray
from sensor_msgs.msg import Image, Imu
from std_msgs.msg import Empty, Header, Int32, String, UInt8MultiArray

import rosbag
from genpy import Time


def message(rng):
    """A message of a random type with random content."""
    size = rng.choice([0, 1, 30, 3000])
    return rng.choice(
        [
            lambda: String("text %s %d" % ("x" * size, rng.randrange(100))),
            lambda: Int32(rng.randrange(-1000, 1000)),
            lambda: Empty(),
            lambda: Header(rng.randrange(100), Time(rng.randrange(1000), 5), "frame"),
            lambda: Imu(orientation_covariance=[rng.random() for _ in range(9)]),
            lambda: PoseArray(poses=[Pose() for _ in range(rng.randrange(5))]),
            lambda: UInt8MultiArray(data=bytes(bytearray(rng.randrange(256) for _ in range(size)))),
            lambda: Image(height=size, encoding="mono8", data=bytes(bytearray(size))),
        ]
    )


def write(path, seed):
    """A bag in time order, of random types, topics, times and sizes."""
    rng = random.Random(seed)  # noqa: S311
    compression = ["none", "bz2", "lz4"][seed % 3]
    threshold = rng.choice([1, 500, 5000, 768 * 1024])
    topics = {"/topic%s" % ("/deep" * n): message(rng) for n in range(rng.randrange(1, 6))}
    now, stamps = rng.choice([0, 1, 1500000000]), []
    for _ in range(rng.choice([0, 1, 10, 80])):
        stamps.append((now, rng.choice([0, 1, 999999999])))
        now += rng.choice([0, 0, 1, 1, 60, 5000])
    with rosbag.Bag(path, "w", compression=compression, chunk_threshold=threshold) as bag:
        for stamp in sorted(stamps):
            topic = rng.choice(sorted(topics))
            more = None
            made = topics[topic]()
            if rng.random() < 0.1:
                bag.compression = rng.choice(["none", "bz2", "lz4"])
            if topic == "/topic":
                more = {"topic": topic, "type": made._type, "md5sum": made._md5sum, "callerid": "/somebody"}
                more.update(latching="1", message_definition=made._full_text)
            bag.write(topic, made, Time(*stamp), connection_header=more)


def fields(header):
    return sorted((name, hashlib.sha1(value).hexdigest()) for name, value in header.items())  # noqa: S324


def read(path):
    """Return everything that rosbag reports about a bag."""
    with rosbag.Bag(path) as bag:
        told = [str(bag), bag._get_yaml_info(), bag.get_message_count(), bag.size, bag.version]
        if bag.get_message_count():
            told += [bag.get_start_time(), bag.get_end_time()]
        told.append(tuple(bag.get_compression_info()))
        types, topics = bag.get_type_and_topic_info()
        told += [sorted(types.items()), sorted((name, tuple(topic)) for name, topic in topics.items())]
        for topic, m, t, header in bag.read_messages(return_connection_header=True):
            text = hashlib.sha1(str(m).encode()).hexdigest()  # noqa: S324
            told.append([topic, text, t.secs, t.nsecs, fields(header)])
        for topic, (kind, data, md5sum, position, _), _t in bag.read_messages(raw=True):
            told.append([topic, kind, hashlib.sha1(data).hexdigest(), md5sum, position])  # noqa: S324
        if topics:
            name = sorted(topics)[0]
            middle = Time(int((bag.get_start_time() + bag.get_end_time()) / 2)) if len(told) > 10 else None
            part = bag.read_messages([name], start_time=middle)
            told.append([[topic, t.secs, t.nsecs] for topic, _, t in part])
            part = bag.read_messages(end_time=middle, connection_filter=lambda topic, *_: topic != name)
            told.append([[topic, t.secs, t.nsecs] for topic, _, t in part])
            told.append(bag.get_message_count([name]))
    return told


if __name__ == "__main__":
    if sys.argv[1] == "write":
        for seed in range(int(sys.argv[3]), int(sys.argv[3]) + int(sys.argv[4])):
            write("%s/%d.bag" % (sys.argv[2], seed), seed)
    else:
        for path in sys.argv[2:]:
            print(json.dumps(read(path)))
