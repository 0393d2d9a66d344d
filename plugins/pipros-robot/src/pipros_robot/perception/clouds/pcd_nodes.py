"""The programs `pcd_to_pointcloud` and `pointcloud_to_pcd` of pcl_ros."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.input_file import read_file
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.replaced_file import write_whole
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import private
from pipros_libraries.nodes.program import run_node
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.messages import in_ns
from pipros_libraries.transforms.pose import IDENTITY
from pipros_robot.perception.clouds.pcd import InvalidPcd, formatted, parse
from pipros_robot.perception.clouds.points import InvalidCloud

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2

FAILED: Final = 255
_WAIT_S: Final = 3.0
_POLL_S: Final = 0.05


@exits_after_ctrl_c()
def pcd_to_pointcloud(argv: Sequence[str] | None = None) -> int:
    """Read a cloud from a file, and publish it on `cloud_pcd`, once or periodically.

    Unless `~latch` is true, wait for a subscriber before publishing. Return the exit code.
    """
    with roscpp_program("pcd_to_pointcloud", "pcl_ros", argv) as (node, log):
        words = node.identity.arguments.rest
        name = words[0] if words else private(node, "file_name", "")
        try:
            interval_s = _seconds(words[1]) if len(words) > 1 else private(node, "interval", 0.0)
            if not name:
                raise InvalidPcd("the file must be given: pcd_to_pointcloud FILE [INTERVAL], or ~file_name")
            cloud, _ = parse(read_file(name))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            log.critical("cannot load the cloud in [%s]: %s", name, reason)
            return FAILED
        cloud.header.frame_id = private(node, "frame_id", "base_link")
        is_latched = private(node, "latch", False)
        output = node.advertise("cloud_pcd", type(cloud), queue_size=1, latch=is_latched)
        log.info("publishing %d points from %s on %s", cloud.width * cloud.height, name, output.topic)
        while not (is_latched or output.connection_count):
            if node.wait_for_shutdown(_POLL_S):
                return 0
        _publish(node, output, cloud)
        if interval_s <= 0:
            node.wait_for_shutdown()
        else:
            while not node.wait_for_shutdown(interval_s):
                _publish(node, output, cloud)
    return 0


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InvalidPcd(f"INTERVAL must be a number of seconds, got {text}") from None


def _publish(node: Node, output: Any, cloud: PointCloud2) -> None:
    cloud.header.stamp = stamp(node.clock)
    output.publish(cloud)


class CloudWriter:
    """Writes each cloud on `input` to a file."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Subscribe. Blocks until the master answers."""
        self._log = log
        self._prefix, self._name = private(node, "prefix", ""), private(node, "filename", "")
        self._mode = "ascii"
        if private(node, "binary", False):
            self._mode = "binary_compressed" if private(node, "compressed", False) else "binary"
        self._frame = private(node, "fixed_frame", "")
        self._listener = TransformListener(node) if self._frame else None
        cloud_class: type[PointCloud2] = load_message_class("sensor_msgs/PointCloud2")
        node.subscribe("input", cloud_class, self._write, queue_size=1, zero_copy=True)

    def _write(self, cloud: PointCloud2) -> None:
        stamp_ns, viewpoint = in_ns(cloud.header.stamp), IDENTITY
        name = f"{self._name}.pcd" if self._name else f"{self._prefix}{stamp_ns // 1000}.pcd"
        try:
            if self._listener is not None:
                source = cloud.header.frame_id.removeprefix("/")
                viewpoint = self._listener.at(self._frame.removeprefix("/"), source, stamp_ns, _WAIT_S)
            write_whole(Path(name), formatted(cloud, self._mode, viewpoint))
        except (InvalidCloud, TransformException, OSError) as error:
            self._log.error("cannot write %s: %s", name, getattr(error, "strerror", None) or error)
            return
        self._log.info("wrote %d points to %s", cloud.width * cloud.height, name)


def pointcloud_to_pcd(argv: Sequence[str] | None = None) -> int:
    """Run `pointcloud_to_pcd` until the node is shut down."""
    return run_node(
        "pointcloud_to_pcd", "pcl_ros", lambda node, log, _: CloudWriter(node, log), argv, anonymous=True
    )
