"""Detect members that join or leave, from liveliness tokens and the link's state.

Uses no clock and no sockets.
"""

from __future__ import annotations

from typing import Final, Protocol

from pipros_fleet import keys
from pipros_fleet.members import Members, Token

LEAVE_S: Final = 0.2
"""Time to wait after a token disappears: if the link is lost, tokens disappear before the loss is noticed."""
RETURN_S: Final = 3.0
"""Time that members have to reconnect to a restarted router before they are considered gone."""


class PresenceListener(Protocol):
    """Interface through which `Presence` reports changes. A protocol because `Agent` imports this module."""

    def on_joined(self, token: Token) -> None:
        """Handle a member that has joined, or whose newest agent instance has changed."""

    def on_returned(self, member: str) -> None:
        """Handle a token that has reappeared: messages from the member may have been lost."""

    def on_left(self, member: str) -> None: ...

    def on_away(self, member: str) -> None:
        """Handle the loss of a member's link, after which it returns or leaves."""

    def on_older_namesake(self) -> None:
        """Handle the discovery of an older member with the same name as this one."""

    def on_other_version(self, token: Token) -> None: ...

    def on_crowded(self, member: str) -> None:
        """Handle a member with more tokens than `TOKENS_PER_MEMBER`. Only the newest tokens count."""


class Presence:
    """Tracks which members are present. While the link is down, no member counts as gone.

    Not thread-safe, except `present`.
    """

    def __init__(self, member: str, instance: str, limit: int, listener: PresenceListener) -> None:
        """Create an empty set for the agent `instance` of `member`. See `Members` for `limit`."""
        self._member = member
        self._instance = instance
        self._members = Members(limit)
        self._listener = listener
        self._leaving: dict[str, float] = {}
        """Tokens that disappeared, with the time from which their members count as gone."""
        self._away: set[str] = set()
        """Tokens that disappeared because the link was lost."""
        self._prune_at_s: float | None = None

    def present(self) -> dict[str, Token]:
        """Return the token of each member that uses this protocol version. Callable from any thread."""
        return self._members.present()

    def update(self, key: str, *, is_present: bool, now_s: float) -> None:
        """Handle the appearance or disappearance of a token."""
        found = keys.read_live(key)
        if not is_present:
            self._leaving[key] = now_s + LEAVE_S
            token = self.present().get(found[0]) if found is not None else None
            if found is not None and token is not None and token.instance == found[2]:
                self._listener.on_away(token.member)
            return
        has_returned = self._leaving.pop(key, None) is not None or key in self._away
        self._away.discard(key)
        if has_returned and found is not None:
            self._listener.on_returned(found[0])
        token = self._members.update(key, is_present=True)
        if found is not None and found[0] in self._members.crowded:
            self._listener.on_crowded(found[0])
        if token is not None:
            self._report(token)

    def _report(self, token: Token) -> None:
        """Notify the listener of a new token."""
        if token.version != keys.VERSION:
            self._listener.on_other_version(token)
        elif token.member != self._member:
            self._listener.on_joined(token)
        elif any(each.instance < self._instance for each in self._members.of(self._member)):
            self._listener.on_older_namesake()

    def note_connection(self, now_s: float) -> None:
        """Handle a restored link. Members that do not return within RETURN_S are considered gone.

        Zenoh announces the other members' tokens again. Requesting all tokens would not help, because the
        replies are incomplete in a session that watches tokens.
        """
        self._prune_at_s = now_s + RETURN_S

    def remove_departed(self, *, is_connected: bool, now_s: float) -> None:
        """Remove members that have left. No member is removed while the link is down."""
        for key, due_s in list(self._leaving.items()):
            if not is_connected:
                del self._leaving[key]
                self._away.add(key)
            elif now_s >= due_s:
                del self._leaving[key]
                self._leave(key)
        if self._prune_at_s is not None and now_s >= self._prune_at_s:
            self._prune_at_s = None
            if is_connected:
                for key in self._away:
                    self._leave(key)
                self._away.clear()

    def _leave(self, key: str) -> None:
        token = self._members.update(key, is_present=False)
        if token is None:
            return
        other = self._members.present().get(token.member)
        if other is not None:
            self._listener.on_joined(other)
        else:
            self._listener.on_left(token.member)
            for admitted in self._members.admit_waiting():
                self._report(admitted)
