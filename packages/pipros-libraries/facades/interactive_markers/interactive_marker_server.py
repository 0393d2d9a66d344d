"""`InteractiveMarkerServer`, which publishes markers to viewers and dispatches their feedback."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any

from geometry_msgs.msg import Pose
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
)

import rospy
from pipros_libraries.markers.state import MarkerContext as MarkerContext
from pipros_libraries.markers.state import Markers
from pipros_libraries.markers.state import UpdateContext as UpdateContext

_KEEP_ALIVE_PERIOD_S = 0.5
_EMPTY_HEADER = Header()


class InteractiveMarkerServer:
    """Server of the interactive markers in a namespace.

    `insert`, `setPose`, `erase` and `clear` take effect on the next call to `applyChanges`; `setCallback`
    takes effect immediately. All methods may be called from any thread, and from callbacks.

    Topics: `<topic_ns>/update` carries changes, and a keep-alive message twice a second;
    `<topic_ns>/update_full` (latched) carries all markers; viewers publish on `<topic_ns>/feedback`.

    Args:
        topic_ns: namespace of the topics.
        server_id: text appended to the node name to form the server's ID; distinguishes several servers in
            the same node and namespace.
        q_size: queue size of the feedback subscriber.
    """

    DEFAULT_FEEDBACK_CB = 255

    def __init__(self, topic_ns: str, server_id: str = "", q_size: int = 100) -> None:
        self.topic_ns = topic_ns
        self.server_id = rospy.get_name() + server_id
        self.seq_num = 0
        self.mutex = Lock()
        self._markers = Markers(InteractiveMarker)
        self.init_pub = rospy.Publisher(
            f"{topic_ns}/update_full", InteractiveMarkerInit, latch=True, queue_size=100
        )
        self.update_pub = rospy.Publisher(f"{topic_ns}/update", InteractiveMarkerUpdate, queue_size=100)
        rospy.Subscriber(
            f"{topic_ns}/feedback", InteractiveMarkerFeedback, self.processFeedback, queue_size=q_size
        )
        rospy.Timer(rospy.Duration(_KEEP_ALIVE_PERIOD_S), self.keepAlive, reset=True)
        self.publishInit()

    @property
    def marker_contexts(self) -> dict[str, MarkerContext]:
        """The published markers, by name."""
        return self._markers.contexts

    @property
    def pending_updates(self) -> dict[str, UpdateContext]:
        """The changes pending for `applyChanges`, by marker name."""
        return self._markers.pending

    def insert(
        self,
        marker: InteractiveMarker,
        feedback_cb: Callable[[InteractiveMarkerFeedback], Any] | int | None = -1,
        feedback_type: int = DEFAULT_FEEDBACK_CB,
    ) -> None:
        """Add a marker. If a marker with the same name exists, replace it, but keep its callbacks.

        If `feedback_cb` is given, it is set as by `setCallback`.
        """
        with self.mutex:
            self._markers.insert(marker)
            if not isinstance(feedback_cb, int):
                self._markers.set_callback(marker.name, feedback_cb, self._event_type(feedback_type))

    def setPose(self, name: str, pose: Pose, header: Header = _EMPTY_HEADER) -> bool:
        """Move a marker. If the header has no frame ID, the marker's header stays unchanged.

        Return False if the marker does not exist, or its insertion is pending.
        """
        with self.mutex:
            return self._markers.set_pose(name, pose, header)

    def erase(self, name: str) -> bool:
        """Remove a marker. Return False if the marker does not exist."""
        with self.mutex:
            return self._markers.erase(name)

    def clear(self) -> None:
        """Remove all markers and drop pending changes."""
        with self.mutex:
            self._markers.clear()

    def setCallback(
        self,
        name: str,
        feedback_cb: Callable[[InteractiveMarkerFeedback], Any] | None,
        feedback_type: int = DEFAULT_FEEDBACK_CB,
    ) -> bool:
        """Set the function to call with the feedback for a marker; None removes the function.

        Return False if the marker does not exist.

        Args:
            feedback_type: the type of event, such as `InteractiveMarkerFeedback.POSE_UPDATE`; by default, all
                types without a specific callback.
        """
        with self.mutex:
            return self._markers.set_callback(name, feedback_cb, self._event_type(feedback_type))

    def applyChanges(self) -> None:
        """Apply the pending changes and publish them. Do nothing if there are no pending changes."""
        with self.mutex:
            changes = self._markers.apply()
            if changes is None:
                return
            self.seq_num += 1
            self.publish(
                InteractiveMarkerUpdate(
                    type=InteractiveMarkerUpdate.UPDATE,
                    markers=changes.inserted,
                    poses=[
                        InteractiveMarkerPose(marker.header, marker.pose, marker.name)
                        for marker in changes.moved
                    ],
                    erases=changes.erased,
                )
            )
            self._publish_init()

    def get(self, name: str) -> InteractiveMarker | None:
        """Return the marker as it will be after `applyChanges`, or None if it will not exist."""
        with self.mutex:
            marker: InteractiveMarker | None = self._markers.get(name)
        return marker

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Handle viewer feedback: store a new pose as a pending change, and call the marker's callback.

        Feedback is ignored if the marker has not been published, or if another viewer sent feedback for it
        less than a second ago.
        """
        with self.mutex:
            is_move = feedback.event_type == InteractiveMarkerFeedback.POSE_UPDATE
            callback = self._markers.take_feedback(feedback, is_move, rospy.Time.now().to_sec())
        if callback:
            callback(feedback)

    def keepAlive(self, msg: Any) -> None:  # noqa: ARG002 # passed by the timer
        """Publish a keep-alive message. Called by a timer."""
        self.publish(InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.KEEP_ALIVE))

    def publish(self, update: InteractiveMarkerUpdate) -> None:
        """Publish an update with the server's ID and sequence number."""
        update.server_id, update.seq_num = self.server_id, self.seq_num
        self.update_pub.publish(update)

    def publishInit(self) -> None:
        """Publish all markers for new viewers."""
        with self.mutex:
            self._publish_init()

    def _publish_init(self) -> None:
        markers = [context.int_marker for context in self._markers.contexts.values()]
        self.init_pub.publish(InteractiveMarkerInit(self.server_id, self.seq_num, markers))

    def _event_type(self, feedback_type: int) -> int | None:
        return None if feedback_type == self.DEFAULT_FEEDBACK_CB else feedback_type
