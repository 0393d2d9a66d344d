"""`MenuHandler`, a menu for interactive markers with a callback for each entry."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from visualization_msgs.msg import InteractiveMarkerFeedback, MenuEntry

import rospy
from interactive_markers.interactive_marker_server import InteractiveMarkerServer

_CHECKBOX = {1: "[x] ", 2: "[ ] "}  # indexed by check state: CHECKED, UNCHECKED


@dataclass(slots=True)
class EntryContext:
    """A menu entry."""

    title: str = ""
    command: str = ""
    command_type: int = 0
    sub_entries: list[int] = field(default_factory=list)
    visible: bool = True
    check_state: int = 0
    feedback_cb: Callable[[InteractiveMarkerFeedback], Any] | None = None


class MenuHandler:
    """A menu that can be attached to any number of markers.

    Changes become visible after calls to `reApply` and to the server's `applyChanges`.
    """

    NO_CHECKBOX = 0
    CHECKED = 1
    UNCHECKED = 2

    def __init__(self) -> None:
        self.top_level_handles_: list[int] = []
        self.entry_contexts_: dict[int, EntryContext] = {}
        self.current_handle_ = 1
        self.managed_markers_: set[str] = set()

    def insert(
        self,
        title: str,
        parent: int | None = None,
        command_type: int = MenuEntry.FEEDBACK,
        command: str = "",
        callback: Callable[[InteractiveMarkerFeedback], Any] | None = None,
    ) -> int | None:
        """Add an entry to the menu, or to the submenu of the entry `parent`.

        Returns:
            The handle of the entry. If the parent does not exist, log an error and return None.
        """
        if parent is not None and parent not in self.entry_contexts_:
            rospy.logerr(f"Parent menu entry {parent} not found.")
            return None
        handle = self.current_handle_
        self.current_handle_ += 1
        self.entry_contexts_[handle] = EntryContext(title, command, command_type, feedback_cb=callback)
        siblings = self.top_level_handles_ if parent is None else self.entry_contexts_[parent].sub_entries
        siblings.append(handle)
        return handle

    def setVisible(self, handle: int, visible: bool) -> bool:
        """Show or hide an entry and its submenu. Return False if the entry does not exist."""
        entry = self.entry_contexts_.get(handle)
        if entry:
            entry.visible = visible
        return entry is not None

    def setCheckState(self, handle: int, check_state: int) -> bool:
        """Set the check state to NO_CHECKBOX, CHECKED or UNCHECKED.

        Return False if the entry does not exist.
        """
        entry = self.entry_contexts_.get(handle)
        if entry:
            entry.check_state = check_state
        return entry is not None

    def getCheckState(self, handle: int) -> int | None:
        """Return NO_CHECKBOX, CHECKED or UNCHECKED, or None if the entry does not exist."""
        entry = self.entry_contexts_.get(handle)
        return entry.check_state if entry else None

    def getTitle(self, handle: int) -> str | None:
        """Return the title of an entry, or None if the entry does not exist."""
        entry = self.entry_contexts_.get(handle)
        return entry.title if entry else None

    def apply(self, server: InteractiveMarkerServer, marker_name: str) -> bool:
        """Attach the current menu to a marker. Return False if the marker does not exist."""
        marker = server.get(marker_name)
        if not marker:
            self.managed_markers_.discard(marker_name)
            return False
        marker.menu_entries = list(self._entries(self.top_level_handles_, 0))
        server.insert(marker, self.processFeedback, InteractiveMarkerFeedback.MENU_SELECT)
        self.managed_markers_.add(marker_name)
        return True

    def reApply(self, server: InteractiveMarkerServer) -> bool:
        """Attach the current menu to all its markers again.

        Return False if one of the markers no longer exists.
        """
        applied = [self.apply(server, name) for name in sorted(self.managed_markers_)]
        return all(applied)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Call the callback of the selected entry, if it has one."""
        entry = self.entry_contexts_.get(feedback.menu_entry_id)
        if entry and entry.feedback_cb:
            entry.feedback_cb(feedback)

    def _entries(self, handles: Iterable[int], parent: int) -> Iterator[MenuEntry]:
        for handle in handles:
            entry = self.entry_contexts_[handle]
            if entry.visible:
                title = _CHECKBOX.get(entry.check_state, "") + entry.title
                yield MenuEntry(handle, parent, title, entry.command, entry.command_type)
                yield from self._entries(entry.sub_entries, handle)
