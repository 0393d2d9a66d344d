"""The inputs that the nodelets for pcl_ros have in common: clouds, and optionally indices of their points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.inputs import SyncInput, synchronized
from pipros_libraries.nodes.params import private
from pipros_libraries.topic_tools.lazy import LazyInputs

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2

    from pipros.node.subscriber import Subscriber
    from pipros_libraries.vision.extras import Array

_CLOUD: Final = "sensor_msgs/PointCloud2"


class CloudInputs:
    """Subscribes to `~input`, and to `~indices` if needed, while any output has subscribers.

    Attributes:
        outputs: the publishers.
    """

    def __init__(
        self,
        node: Node,
        outputs: Mapping[str, Any],
        receive: Callable[[PointCloud2, Array | None], object],
        needs_indices: bool = False,
    ) -> None:
        """Advertise the outputs. Blocks until the master answers.

        Args:
            outputs: message classes by topic.
            receive: called with each cloud and its point indices (None without `~indices`).
            needs_indices: whether to subscribe to `~indices` even if `~use_indices` is false.
        """
        self._node, self._receive = node, receive
        self.queue_size = max(private(node, "max_queue_size", 3), 1)
        self._has_indices = needs_indices or private(node, "use_indices", False)
        self._is_approximate = private(node, "approximate_sync", False)
        self.outputs = [
            node.advertise(topic, kind, queue_size=self.queue_size) for topic, kind in outputs.items()
        ]
        self._lazy = LazyInputs(self.outputs, self._subscribe)

    def close(self) -> None:
        """Unsubscribe."""
        self._lazy.close()

    def _subscribe(self) -> Sequence[Subscriber[PointCloud2]]:
        if self._has_indices:
            return synchronized(
                self._node,
                [SyncInput("~input", _CLOUD), SyncInput("~indices", "pcl_msgs/PointIndices")],
                lambda cloud, indices: self._receive(cloud, indices.indices),
                self.queue_size,
                is_exact=not self._is_approximate,
            )
        kind = load_message_class(_CLOUD)
        return [
            self._node.subscribe(
                "~input",
                kind,
                lambda cloud: self._receive(cloud, None),
                queue_size=self.queue_size,
                zero_copy=True,
            )
        ]
