"""Reports when no handle of a goal is left."""

from __future__ import annotations

from typing import Any

import rospy


class HandleTrackerDeleter:
    """Called when a goal is let go: its server then forgets it after a while."""

    def __init__(self, action_server: Any, status_tracker: Any) -> None:
        self.action_server = action_server
        self.status_tracker = status_tracker

    def __call__(self, ptr: Any) -> None:  # noqa: ARG002 # as others call it
        if self.action_server:
            with self.action_server.lock:
                self.status_tracker.handle_destruction_time = rospy.Time.now()
