"""Record when the last handle of a goal is deleted."""

from __future__ import annotations

from typing import Any

import rospy


class HandleTrackerDeleter:
    """Callable that records the current time as the time when a goal's last handle was deleted.

    The server removes the goal from its status list `status_list_timeout` after the recorded time. pipros
    creates instances, which programs find in `StatusTracker.handle_tracker`, but never calls them.
    """

    def __init__(self, action_server: Any, status_tracker: Any) -> None:
        self.action_server = action_server
        self.status_tracker = status_tracker

    def __call__(self, ptr: Any) -> None:  # noqa: ARG002 # Noetic's signature
        if self.action_server:
            with self.action_server.lock:
                self.status_tracker.handle_destruction_time = rospy.Time.now()
