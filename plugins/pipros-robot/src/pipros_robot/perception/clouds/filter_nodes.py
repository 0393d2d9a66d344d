"""The filters of pcl_ros as nodelets, such as `pcl/PassThrough`, `pcl/VoxelGrid` and `pcl/CropBox`."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyNode
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.perception.clouds import filters
from pipros_robot.perception.clouds.inputs import CloudInputs
from pipros_robot.perception.clouds.points import (
    POSITION,
    InvalidCloud,
    column,
    exact_matrix_of,
    moved,
    positions,
    reorganized,
    rows_of,
)
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array

_WAIT_S: Final = 1.0
_FRAMES: Final = (Setting("input_frame", ""), Setting("output_frame", ""))
_LIMITS: Final = (
    Setting("filter_field_name", "z"),
    Setting("filter_limit_min", 0.0, -100_000.0, 100_000.0),
    Setting("filter_limit_max", 1.0, -100_000.0, 100_000.0),
    Setting("filter_limit_negative", False),
    Setting("keep_organized", False),
    *_FRAMES,
)


class CloudFilterNodelet(LazyNode):
    """Base of nodelets that filter `~input` and publish `~output`, while `~output` has subscribers."""

    settings: ClassVar[tuple[Setting, ...]] = ()
    needs_indices: ClassVar[bool] = False
    keeps_sizes: ClassVar[bool] = False

    def __init__(self, node: Node) -> None:
        """Advertise the output, and serve the settings. Blocks until the master answers."""
        self._node, self._errors = node, Throttle(node.log, 1.0)
        self._listener: TransformListener | None = None
        self._listener_lock = threading.Lock()
        self.values: Mapping[str, Any] = {}
        Reconfigurable(node, "~", self.settings, self._configure)
        cloud_class: type[PointCloud2] = load_message_class("sensor_msgs/PointCloud2")
        self._inputs = CloudInputs(node, {"~output": cloud_class}, self._on_cloud, self.needs_indices)
        (self._output,) = self._inputs.outputs

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:
        """Return the filtered cloud. Subclasses override this method.

        Raises:
            InvalidCloud: the cloud or a setting is invalid.
        """
        raise NotImplementedError

    def _configure(self, values: Mapping[str, Value], _: int) -> None:
        self.values = values
        if values.get("input_frame") or values.get("output_frame"):
            with self._listener_lock:
                if self._listener is None:
                    self._listener = TransformListener(self._node)

    def _on_cloud(self, cloud: PointCloud2, indices: Array | None) -> None:
        frame = cloud.header.frame_id
        target, back = self.values.get("input_frame"), self.values.get("output_frame")
        try:
            rows_of(cloud)
            given = self._in_frame(cloud, target) if target else cloud
            try:
                made = self.filtered(given, indices)
            except InvalidCloud as error:
                self._errors.error("%s", error)
                made = filters.emptied(given, keeps_sizes=self.keeps_sizes)
            self._output.publish(self._in_frame(made, back or frame) if target or back else made)
        except (InvalidCloud, TransformException) as error:
            self._errors.error("dropped a cloud: %s", error)

    def _in_frame(self, cloud: PointCloud2, target: str) -> PointCloud2:
        """Return the cloud transformed to the frame `target`, with the same timestamp."""
        source = cloud.header.frame_id
        if target.removeprefix("/") == source.removeprefix("/") or self._listener is None:
            return cloud
        pose = self._listener.at(
            target.removeprefix("/"), source.removeprefix("/"), in_ns(cloud.header.stamp), _WAIT_S
        )
        header: Header = load_message_class("std_msgs/Header")(stamp=cloud.header.stamp, frame_id=target)
        made = transformed(cloud, exact_matrix_of(pose))
        made.header = header
        return made


def transformed(cloud: PointCloud2, matrix: Array) -> PointCloud2:
    """Transform a cloud's points, and their viewpoints, if any. Points that are not finite are unchanged."""
    rows = rows_of(cloud).copy()
    points = positions(cloud, rows)
    finite = np.isfinite(points).all(1)
    results = moved(points[finite], matrix)
    names = {each.name for each in cloud.fields}
    for axis, name in enumerate(POSITION):
        column(cloud, rows, name)[finite] = results[:, axis]
    viewpoint = ["vp_x", "vp_y", "vp_z"]
    if names.issuperset(viewpoint):
        places = moved(np.stack([column(cloud, rows, name) for name in viewpoint], 1), matrix)
        for axis, name in enumerate(viewpoint):
            column(cloud, rows, name)[finite] = places[finite, axis]
    return reorganized(cloud, rows, is_dense=cloud.is_dense)


class PassThrough(CloudFilterNodelet):
    """The nodelet `pcl/PassThrough`."""

    settings = _LIMITS
    keeps_sizes = True

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:  # noqa: ARG002 # as PCL's
        return filters.pass_through(cloud, self.values)


class VoxelGrid(CloudFilterNodelet):
    """The nodelet `pcl/VoxelGrid`."""

    settings = (
        Setting("leaf_size", 0.01, 0.0, 1.0),
        *(Setting(f"leaf_size_{axis}", -1.0, -1.0, 1.0) for axis in POSITION),
        Setting("min_points_per_voxel", 1, 1, 100_000),
        *_LIMITS,
    )

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:  # noqa: ARG002 # as PCL's
        return filters.voxel_grid(cloud, self.values)


class CropBox(CloudFilterNodelet):
    """The nodelet `pcl/CropBox`."""

    settings = (
        *(Setting(f"min_{axis}", -1.0, -1000.0, 1000.0) for axis in POSITION),
        *(Setting(f"max_{axis}", 1.0, -1000.0, 1000.0) for axis in POSITION),
        Setting("keep_organized", False),
        Setting("negative", False),
        *_FRAMES,
    )

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:
        return filters.crop_box(cloud, self.values, indices)


class ExtractIndices(CloudFilterNodelet):
    """The nodelet `pcl/ExtractIndices`."""

    settings = (Setting("negative", False),)
    needs_indices = True

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:
        return filters.extract_indices(cloud, indices, self.values)


class StatisticalOutlierRemoval(CloudFilterNodelet):
    """The nodelet `pcl/StatisticalOutlierRemoval`."""

    settings = (
        Setting("mean_k", 2, 2, 100),
        Setting("stddev", 0.0, 0.0, 5.0),
        Setting("negative", False),
    )

    def filtered(self, cloud: PointCloud2, indices: Array | None) -> PointCloud2:
        return filters.statistical_outlier_removal(cloud, self.values, indices)
