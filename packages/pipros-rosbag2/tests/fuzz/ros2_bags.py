"""Any bytes of a file of a ROS 2 bag, or of its metadata, are messages or raise BagError.

python -m tests.fuzz.ros2_bags --seconds 60
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
from pathlib import Path

from pipros_rosbag2.bags.metadata import parse_metadata
from pipros_rosbag2.bags.reader import Ros2BagReader
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text
from tests.fuzz import mutation

WORDS = [
    *(b"cdr", b"ros2msg", b"SQLite format 3\0", b"\x89MCAP0\r\n", b"zstd", b"messages", b"topics"),
    *(b"std_msgs/msg/String", b"string<=5 data", b"MSG: a/B", b"=" * 80, b"wstring w", b"- durability: 1"),
]


def target(data: bytes) -> None:
    with contextlib.suppress(BagError):
        parse_metadata(data.decode("utf-8", "replace"), "metadata.yaml")
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(BagError):
        file = Path(folder, "bag")
        file.write_bytes(data)
        with Ros2BagReader(file) as bag:
            assert info_text(bag_info(bag, "bag", with_frequencies=True))
            for _ in bag.messages():
                pass


if __name__ == "__main__":
    sys.exit(mutation.main(target, "ros2_bags", WORDS))
