"""Any bytes of a message of ROS 2 or ROS 1 are converted, or raise ConversionError, in bounded memory.

An input names its type of ROS 2 in the first line: `sensor_msgs/msg/Image`, a newline, the bytes.

python -m tests.fuzz.cdr --seconds 60
"""

from __future__ import annotations

import contextlib
import sys
import tracemalloc

from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.distribution import Distribution
from tests.fuzz import mutation
from tests.support.ros2_samples import plans_of, shared_types

MEMORY_OF_A_COMPILER = 8_000_000
MEMORY_PER_BYTE = 400
"""An array element of four bytes becomes several parts, each an object."""

TYPES = frozenset(shared_types(Distribution.JAZZY))


def target(data: bytes) -> None:
    name, _, body = data.partition(b"\n")
    text = name.decode("ascii", "replace")
    if text not in TYPES:
        return
    plan = plans_of(Distribution.JAZZY).for_ros2(text)
    tracemalloc.start()
    try:
        with contextlib.suppress(ConversionError):
            plan.to_cdr(body)
        with contextlib.suppress(ConversionError):
            ros1 = plan.to_ros1(body)
            assert plan.to_ros1(plan.to_cdr(ros1)) == ros1
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < MEMORY_OF_A_COMPILER + MEMORY_PER_BYTE * len(body), f"{peak} bytes for {len(body)}"


if __name__ == "__main__":
    sys.exit(mutation.main(target, "cdr"))
