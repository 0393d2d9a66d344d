"""The nodelets `pcl/SACSegmentation` (planes) and `pcl/EuclideanClusterExtraction`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros_libraries.nodes.params import private, raw
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.topic_tools.lazy import LazyNode
from pipros_libraries.transforms.messages import in_ns
from pipros_robot.perception.clouds.inputs import CloudInputs
from pipros_robot.perception.clouds.points import InvalidCloud, cloud_of, indices_of, positions, rows_of
from pipros_robot.perception.clouds.segmentation import clusters, plane
from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from pcl_msgs.msg import ModelCoefficients, PointIndices
    from sensor_msgs.msg import PointCloud2
    from std_msgs.msg import Header

    from pipros_libraries.vision.extras import Array

_PLANE: Final = 0
_MOST: Final = 2**31 - 1
_STEP_NS: Final = 1_000_000


class MissingParameter(PiprosError):
    """A required parameter is missing or has an unsupported value. The text names the parameter."""


class _Segmentation(LazyNode):
    """Base of segmentation nodelets. Handles inputs and settings, and extracts the points from clouds."""

    settings: tuple[Setting, ...] = ()
    _inputs: CloudInputs

    def __init__(self, node: Node, outputs: Mapping[str, Any]) -> None:
        self._node, self._errors = node, Throttle(node.log, 1.0)
        self.values: Mapping[str, Any] = {}
        Reconfigurable(node, "~", self.settings, self._configure)
        self._inputs = CloudInputs(node, outputs, self._on_cloud)

    def _configure(self, values: Mapping[str, Value], _: int) -> None:
        self.values = values

    def _on_cloud(self, cloud: PointCloud2, indices: Array | None) -> None:
        try:
            points = positions(cloud, rows_of(cloud))
            self.segment(cloud.header, points, indices_of(indices, len(points)))
        except InvalidCloud as error:
            self._errors.error("dropped a cloud: %s", error)

    def segment(self, header: Header, points: Array, chosen: Array) -> None:
        """Publish the results for the points with the chosen indices."""
        raise NotImplementedError


def _required(node: Node, name: str) -> Any:
    if (value := raw(node, name)) is None:
        raise MissingParameter(f"the parameter {node.resolve(f'~{name}')} must be set")
    return value


class SacSegmentation(_Segmentation):
    """Finds the plane with the most points, and publishes its `~inliers` and `~model`.

    Both are empty if no plane has more than `min_inliers` points.
    """

    settings = (
        Setting("max_iterations", 50, 0, 100_000),
        Setting("probability", 0.99, 0.5, 0.99),
        Setting("distance_threshold", 0.02, 0.0, 1.0),
        Setting("optimize_coefficients", True),
        Setting("radius_min", 0.0, 0.0, 1.0),
        Setting("radius_max", 0.05, 0.0, 1.0),
        Setting("eps_angle", 0.17, 0.0, 1.5707),
        Setting("min_inliers", 0, 0, 100_000),
        Setting("input_frame", ""),
        Setting("output_frame", ""),
    )

    def __init__(self, node: Node) -> None:
        """Check the parameters, and advertise. Blocks until the master answers.

        Raises:
            MissingParameter: `~model_type` is not 0 (a plane), or `~distance_threshold` is not set.
        """
        model = _required(node, "model_type")
        if model != _PLANE:
            raise MissingParameter(
                f"~model_type must be 0 (a plane), the only supported model, got {model!r}"
            )
        _required(node, "distance_threshold")
        self._indices: type[PointIndices] = load_message_class("pcl_msgs/PointIndices")
        self._model: type[ModelCoefficients] = load_message_class("pcl_msgs/ModelCoefficients")
        super().__init__(node, {"~inliers": self._indices, "~model": self._model})
        self._inliers_output, self._model_output = self._inputs.outputs

    def segment(self, header: Header, points: Array, chosen: Array) -> None:
        given = self.values
        found = plane(
            points[chosen],
            given["distance_threshold"],
            given["max_iterations"],
            given["probability"],
            given["optimize_coefficients"],
            lambda: self._node.is_ending,
        )
        inliers, model = self._indices(), self._model()
        inliers.header.stamp = model.header.stamp = header.stamp
        inliers.header.frame_id = model.header.frame_id = header.frame_id
        if found is not None and len(found[1]) > given["min_inliers"]:
            model.values, inliers.indices = found[0].tolist(), chosen[found[1]].astype(np.int32)
        self._inliers_output.publish(inliers)
        self._model_output.publish(model)


class EuclideanClusterExtraction(_Segmentation):
    """Publishes the points of each cluster on `~output`, or their indices if `~publish_indices` is true.

    The timestamps of the clusters of one cloud increase in steps of 1 ms.
    """

    settings = (
        Setting("cluster_tolerance", 0.05, 0.0, 2.0),
        Setting("cluster_min_size", 1, 0, 1000),
        Setting("cluster_max_size", _MOST, 0, _MOST),
        Setting("max_clusters", _MOST, 1, _MOST),
    )

    def __init__(self, node: Node) -> None:
        """Check the parameters, and advertise. Blocks until the master answers.

        Raises:
            MissingParameter: `~cluster_tolerance` or `~spatial_locator` (which is otherwise ignored) is not
                set.
        """
        for name in ("cluster_tolerance", "spatial_locator"):
            _required(node, name)
        self._publishes_indices = private(node, "publish_indices", False)
        kind = "pcl_msgs/PointIndices" if self._publishes_indices else "sensor_msgs/PointCloud2"
        self._class: Any = load_message_class(kind)
        super().__init__(node, {"~output": self._class})
        (self._output,) = self._inputs.outputs

    def segment(self, header: Header, points: Array, chosen: Array) -> None:
        given = self.values
        found = clusters(
            points[chosen], given["cluster_tolerance"], given["cluster_min_size"], given["cluster_max_size"]
        )
        header_class: Any = type(header)
        for index, each in enumerate(found[: given["max_clusters"]]):
            stamp_ns = in_ns(header.stamp) + index * _STEP_NS
            made = header_class(frame_id=header.frame_id, stamp=Time(*divmod(stamp_ns, NS_PER_S)))
            cluster = chosen[each]
            if self._publishes_indices:
                self._output.publish(self._class(made, np.sort(cluster).astype(np.int32)))
            else:
                columns = dict(zip("xyz", points[cluster].T, strict=True))
                self._output.publish(cloud_of(made, columns, point_step=16))
