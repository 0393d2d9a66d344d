"""The markers of a server, and the changes that wait until they are applied.

A marker is an object with `name`, `header` and `pose`, such as a visualization_msgs/InteractiveMarker.

A change of a name replaces the one that waits for it:

===========  =====================================  ============================  ===========
waits        insert                                 pose (by a call)              erase
===========  =====================================  ============================  ===========
nothing      insert                                 pose, if the marker exists    erase, if it exists
insert       the newer insert                       refused                       erase
pose         insert                                 the newer pose                erase
erase        insert                                 pose                          erase
===========  =====================================  ============================  ===========

A pose that a viewer sends moves a marker that waits to be inserted, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Callback = Callable[[Any], Any]

CONFLICT_S = 1.0
"""How long after the feedback of one viewer that of another one is ignored."""


class _Callbacks:
    """What is called with the feedback of a marker: for a type of event, or for all others."""

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
    """A marker that viewers know."""

    def __init__(self, int_marker: Any = None) -> None:
        super().__init__()
        self.int_marker = int_marker
        self.last_feedback_s: float | None = None
        self.last_client_id = ""


class UpdateContext(_Callbacks):
    """A change that waits. Of `int_marker`, POSE_UPDATE has pose and header only, and ERASE nothing."""

    FULL_UPDATE = 0
    POSE_UPDATE = 1
    ERASE = 2

    def __init__(self, update_type: int = FULL_UPDATE, int_marker: Any = None) -> None:
        super().__init__()
        self.update_type = update_type
        self.int_marker = int_marker


@dataclass(slots=True)
class Changes:
    """What viewers must be told: new or replaced markers, markers that moved, names that are gone."""

    inserted: list[Any] = field(default_factory=list)
    moved: list[Any] = field(default_factory=list)
    erased: list[str] = field(default_factory=list)


class Markers:
    """The markers of one server.

    Args:
        new_marker: makes an empty marker, for a pose that waits.
    """

    def __init__(self, new_marker: Callable[[], Any]) -> None:
        self._new_marker = new_marker
        self.contexts: dict[str, MarkerContext] = {}
        self.pending: dict[str, UpdateContext] = {}

    def insert(self, marker: Any) -> None:
        """The marker is to be shown, in place of one with its name."""
        update = self.pending.setdefault(marker.name, UpdateContext())
        update.update_type, update.int_marker = UpdateContext.FULL_UPDATE, marker

    def set_pose(self, name: str, pose: Any, header: Any) -> bool:
        """The marker is to be moved. False if it does not exist, or waits to be inserted.

        An empty frame in the header leaves the header as it is.
        """
        update, context = self.pending.get(name), self.contexts.get(name)
        if context is None or (update is not None and update.update_type == UpdateContext.FULL_UPDATE):
            return False
        self._move(name, pose, header if header.frame_id else context.int_marker.header)
        return True

    def erase(self, name: str) -> bool:
        """The marker is to go. False if it does not exist."""
        if name not in self.pending:
            if name not in self.contexts:
                return False
            self.pending[name] = UpdateContext(UpdateContext.ERASE, self._new_marker())
        self.pending[name].update_type = UpdateContext.ERASE
        return True

    def clear(self) -> None:
        """All markers are to go, and no other change waits."""
        self.pending.clear()
        for name in self.contexts:
            self.erase(name)

    def set_callback(self, name: str, callback: Callback | None, event_type: int | None) -> bool:
        """Call `callback` with feedback of this type, or without a type, with all that has none of its own.

        It counts at once. False if the marker does not exist.
        """
        found = [entry for entry in (self.contexts.get(name), self.pending.get(name)) if entry is not None]
        for entry in found:
            entry.set(callback, event_type)
        return bool(found)

    def get(self, name: str) -> Any:
        """The marker as it will be when the changes are applied; None if it does not exist then."""
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
        """Make the changes that wait, in the order of their names' first mention; None if nothing waits."""
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
        """Take note of what a viewer did; where it moved the marker, that is a change that waits.

        Returns:
            What to call with it. None also where another viewer was active less than `CONFLICT_S` ago.
        """
        context = self.contexts.get(feedback.marker_name)
        if context is None:
            return None
        if (
            context.last_feedback_s is not None
            and context.last_client_id != feedback.client_id
            and now_s - context.last_feedback_s < CONFLICT_S
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
