"""`ServerGoalHandle`, the server-side handle of a goal."""

from __future__ import annotations

from typing import Any

from actionlib_msgs.msg import GoalID, GoalStatus

import rospy
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.actions.server_goal import GoalEvent, after, why_not
from pipros_libraries.actions.status import TERMINAL

_star_names(__name__, "actionlib_msgs")


class ServerGoalHandle:
    """Handle to accept or reject a goal, publish feedback and set its final status.

    Invalid transitions, such as success before acceptance or a second final status, are logged as errors and
    ignored. All methods may be called from any thread.
    """

    def __init__(
        self, status_tracker: Any = None, action_server: Any = None, handle_tracker: Any = None
    ) -> None:
        self.status_tracker = status_tracker
        self.action_server = action_server
        self.handle_tracker = handle_tracker
        self.goal = status_tracker.goal if status_tracker else None

    def get_default_result(self) -> Any:
        """Return a result with default values."""
        return self.action_server.ActionResultType()

    def set_accepted(self, text: str = "") -> None:
        """Accept the goal: set its status to ACTIVE, or PREEMPTING if cancellation was requested."""
        self._set(GoalEvent.ACCEPT, None, text)

    def set_canceled(self, result: Any = None, text: str = "") -> None:
        """End the goal as cancelled: RECALLED before `set_accepted`, PREEMPTED after it."""
        self._set(GoalEvent.CANCEL, result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """Reject the goal; valid only before `set_accepted`."""
        self._set(GoalEvent.REJECT, result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal as ABORTED."""
        self._set(GoalEvent.ABORT, result, text)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal as SUCCEEDED."""
        self._set(GoalEvent.SUCCEED, result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback for the goal."""
        if not self.goal:
            rospy.logerr("publish_feedback requires a ServerGoalHandle with a goal")
            return
        with self.action_server.lock:
            self.action_server.publish_feedback(self.status_tracker.status, feedback)

    def get_goal(self) -> Any:
        """Return the client's goal message, or None for a handle without a goal."""
        return self.goal.goal if self.goal else None

    def get_goal_id(self) -> GoalID:
        """Return the goal ID, or an empty GoalID for a handle without a goal."""
        if not self.goal:
            rospy.logerr("get_goal_id requires a ServerGoalHandle with a goal")
            return GoalID()
        with self.action_server.lock:
            goal_id: GoalID = self.status_tracker.status.goal_id
            return goal_id

    def get_goal_status(self) -> GoalStatus:
        """Return the status of the goal, or an empty GoalStatus for a handle without a goal."""
        if not self.goal:
            rospy.logerr("get_goal_status requires a ServerGoalHandle with a goal")
            return GoalStatus()
        with self.action_server.lock:
            status: GoalStatus = self.status_tracker.status
            return status

    def set_cancel_requested(self) -> bool:
        """Record a cancellation request.

        Return False if a request is already recorded, if the goal has ended, or if the handle has no goal.
        """
        if not self.goal:
            return False
        with self.action_server.lock:
            status = self.status_tracker.status
            new = after(status.status, GoalEvent.CANCEL_REQUESTED)
            if new is None:
                return False
            status.status = int(new)
            self.action_server.publish_status()
            return True

    def _set(self, event: GoalEvent, result: Any, text: str) -> None:
        if not self.goal:
            rospy.logerr("ServerGoalHandle without a goal cannot be %s", event.value)
            return
        with self.action_server.lock:
            status = self.status_tracker.status
            new = after(status.status, event)
            if new is None:
                rospy.logerr("goal %s: %s", status.goal_id.id, why_not(status.status, event))
                return
            status.status, status.text = int(new), text
            if new not in TERMINAL:
                self.action_server.publish_status()
                return
            self.status_tracker.handle_destruction_time = rospy.Time.now()
            self.action_server.publish_result(status, result or self.get_default_result())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle) or not self.goal or not other.goal:
            return False
        return self.get_goal_id().id == other.get_goal_id().id

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self.get_goal_id().id)
