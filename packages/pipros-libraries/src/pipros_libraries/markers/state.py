"""A server's markers, and the changes that are pending until they are applied.

A marker is an object with `name`, `header` and `pose`, such as a visualization_msgs/InteractiveMarker.

A marker has at most one pending change. For each pending change (left) and each new change (top), the table
shows the resulting pending change:

===========  =====================================  ============================  ===========
pending      insert                                 pose (by a call)              erase
===========  =====================================  ============================  ===========
nothing      insert                                 pose, if the marker exists    erase, if it exists
insert       the newer insert                       refused                       erase
pose         insert                                 the newer pose                erase
erase        insert                                 pose                          erase
===========  =====================================  ============================  ===========

A pose from a viewer also moves a marker whose insertion is pending.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pipros.basics.intervals import elapsed

Callback = Callable[[Any], Any]

CONFLICT_S = 1.0
"""Time after feedback from one viewer during which feedback from other viewers is ignored."""


class _Callbacks:
    """The feedback callbacks of a marker: one per event type, and a default callback."""

    def __init__(self) -> None:
        self.default_feedback_cb: Callback | None = None
        self.feedback_cbs: dict[int, Callback] = {}

    def set(self, callback: Callback | None, event_type: int | None) -> None:
        if event_type is None:
            self.default_feedback_cb = callback
        elif callback:
            self.feedback_cbs[event_type] = callback
        else:
            self.feedback_cbs.pop(event_type, None)

    def of(self, event_type: int) -> Callback | None:
        return self.feedback_cbs.get(event_type, self.default_feedback_cb)


class MarkerContext(_Callbacks):
    """A published marker."""

    def __init__(self, int_marker: Any = None) -> None:
        super().__init__()
        self.int_marker = int_marker
        self.last_feedback_s: float | None = None
        self.last_client_id = ""


class UpdateContext(_Callbacks):
    """A pending change.

    For POSE_UPDATE, only the pose and header of `int_marker` are used; for ERASE, `int_marker` is not used.
    """

    FULL_UPDATE = 0
    POSE_UPDATE = 1
    ERASE = 2

    def __init__(self, update_type: int = FULL_UPDATE, int_marker: Any = None) -> None:
        super().__init__()
        self.update_type = update_type
        self.int_marker = int_marker


@dataclass(slots=True)
class Changes:
    """Applied changes: new or replaced markers, moved markers, and the names of erased markers."""

    inserted: list[Any] = field(default_factory=list)
    moved: list[Any] = field(default_factory=list)
    erased: list[str] = field(default_factory=list)


class Markers:
    """The markers of one server. Changes to markers are pending until `apply` is called. Not thread-safe.

    Args:
        new_marker: function that returns an empty marker, for pending poses and erasures.
    """

    def __init__(self, new_marker: Callable[[], Any]) -> None:
        self._new_marker = new_marker
        self.contexts: dict[str, MarkerContext] = {}
        self.pending: dict[str, UpdateContext] = {}

    def insert(self, marker: Any) -> None:
        """Add a marker, replacing any marker with the same name."""
        update = self.pending.setdefault(marker.name, UpdateContext())
        update.update_type, update.int_marker = UpdateContext.FULL_UPDATE, marker

    def set_pose(self, name: str, pose: Any, header: Any) -> bool:
        """Move a marker. Return False if it does not exist, or its insertion is pending.

        If the frame ID in `header` is empty, the marker's header stays unchanged.
        """
        update, context = self.pending.get(name), self.contexts.get(name)
        if context is None or (update is not None and update.update_type == UpdateContext.FULL_UPDATE):
            return False
        self._move(name, pose, header if header.frame_id else context.int_marker.header)
        return True

    def erase(self, name: str) -> bool:
        """Erase a marker. Return False if it does not exist."""
        if name not in self.pending:
            if name not in self.contexts:
                return False
            self.pending[name] = UpdateContext(UpdateContext.ERASE, self._new_marker())
        self.pending[name].update_type = UpdateContext.ERASE
        return True

    def clear(self) -> None:
        """Erase all markers and drop all other pending changes."""
        self.pending.clear()
        for name in self.contexts:
            self.erase(name)

    def set_callback(self, name: str, callback: Callback | None, event_type: int | None) -> bool:
        """Set the callback for feedback of an event type, or the default callback if the type is None.

        Takes effect immediately. Return False if the marker does not exist.
        """
        found = [entry for entry in (self.contexts.get(name), self.pending.get(name)) if entry is not None]
        for entry in found:
            entry.set(callback, event_type)
        return bool(found)

    def get(self, name: str) -> Any:
        """Return the marker as it will be after `apply`, or None if it will not exist."""
        update, context = self.pending.get(name), self.contexts.get(name)
        if update is None:
            return context.int_marker if context else None
        if update.update_type == UpdateContext.FULL_UPDATE:
            return update.int_marker
        if update.update_type == UpdateContext.ERASE or context is None:
            return None
        context.int_marker.pose = update.int_marker.pose
        return context.int_marker

    def apply(self) -> Changes | None:
        """Apply the pending changes in the order in which their markers were first changed.

        Return None if there are no pending changes.
        """
        if not self.pending:
            return None
        changes, pending, self.pending = Changes(), self.pending, {}
        for name, update in pending.items():
            context = self.contexts.get(name)
            if update.update_type == UpdateContext.FULL_UPDATE:
                if context is None:
                    context = self.contexts[name] = MarkerContext()
                    context.default_feedback_cb = update.default_feedback_cb
                    context.feedback_cbs = update.feedback_cbs
                context.int_marker = update.int_marker
                changes.inserted.append(context.int_marker)
            elif context is None:
                continue
            elif update.update_type == UpdateContext.POSE_UPDATE:
                marker = context.int_marker
                marker.pose, marker.header = update.int_marker.pose, update.int_marker.header
                changes.moved.append(marker)
            else:
                del self.contexts[name]
                changes.erased.append(name)
        return changes

    def take_feedback(self, feedback: Any, is_move: bool, now_s: float) -> Callback | None:
        """Handle feedback from a viewer. A move of the marker becomes a pending change.

        Returns:
            The callback to call, or None if the marker does not exist, has no callback for this event, or
            received feedback from another viewer less than `CONFLICT_S` ago.
        """
        context = self.contexts.get(feedback.marker_name)
        if context is None:
            return None
        if (
            context.last_feedback_s is not None
            and context.last_client_id != feedback.client_id
            and elapsed(now_s, context.last_feedback_s) < CONFLICT_S
        ):
            return None
        context.last_feedback_s, context.last_client_id = now_s, feedback.client_id
        if is_move:
            follows_frame = context.int_marker.header.stamp.is_zero()
            header = context.int_marker.header if follows_frame else feedback.header
            self._move(feedback.marker_name, feedback.pose, header)
        return context.of(feedback.event_type)

    def _move(self, name: str, pose: Any, header: Any) -> None:
        update = self.pending.get(name)
        if update is None:
            update = self.pending[name] = UpdateContext(UpdateContext.POSE_UPDATE, self._new_marker())
        if update.update_type != UpdateContext.FULL_UPDATE:
            update.update_type = UpdateContext.POSE_UPDATE
        update.int_marker.pose, update.int_marker.header = pose, header
