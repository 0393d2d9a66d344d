"""Which members join and leave, by their tokens and the state of the link. No clock, no sockets."""

from __future__ import annotations

from typing import Final, Protocol

from pipros.fleet import keys
from pipros.fleet.members import Members, Token

LEAVE_S: Final = 0.2
"""Time after the end of a token in which the end of the link may be noticed, which ends all tokens."""
RETURN_S: Final = 3.0
"""Time that members have to connect to a router that was restarted, before they are considered gone."""


class PresenceListener(Protocol):
    """Called by `Presence`."""

    def on_joined(self, token: Token) -> None:
        """A member, or a new run of its agent, can be asked for its documents."""

    def on_returned(self, member: str) -> None:
        """A token disappeared for a moment, so messages of the member may have been lost."""

    def on_left(self, member: str) -> None: ...

    def on_older_namesake(self) -> None:
        """A member that joined earlier has the name of this one."""

    def on_other_version(self, token: Token) -> None: ...


class Presence:
    """Tells a member that left from one whose token disappeared only with a link. One thread calls it."""

    def __init__(self, member: str, instance: str, limit: int, listener: PresenceListener) -> None:
        """`member`, `instance`: this member. `limit`: greatest number of tokens."""
        self._member = member
        self._instance = instance
        self._members = Members(limit)
        self._listener = listener
        self._leaving: dict[str, float] = {}
        """Tokens that disappeared, with the time at which their members have left."""
        self._away: set[str] = set()
        """Tokens that disappeared with the link."""
        self._prune_at_s: float | None = None

    def present(self) -> dict[str, Token]:
        """Return the usable token of each member. Thread-safe."""
        return self._members.present()

    def update(self, key: str, *, is_present: bool, now_s: float) -> None:
        """Note that a token appeared or disappeared."""
        if not is_present:
            self._leaving[key] = now_s + LEAVE_S
            return
        has_returned = self._leaving.pop(key, None) is not None or key in self._away
        self._away.discard(key)
        found = keys.read_live(key)
        if has_returned and found is not None:
            self._listener.on_returned(found[0])
        token = self._members.update(key, is_present=True)
        if token is None:
            return
        if token.version != keys.VERSION:
            self._listener.on_other_version(token)
        elif token.member != self._member:
            self._listener.on_joined(token)
        elif any(each.instance < self._instance for each in self._members.of(self._member)):
            self._listener.on_older_namesake()

    def note_connection(self, now_s: float) -> None:
        """Note that the link is back. Members that do not return within RETURN_S have left.

        Their tokens are announced again. A request for all tokens would not help, because its answers are
        incomplete in a session that watches tokens.
        """
        self._prune_at_s = now_s + RETURN_S

    def settle(self, *, is_connected: bool, now_s: float) -> None:
        """Forget members that have left. While the link is down, none has."""
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
