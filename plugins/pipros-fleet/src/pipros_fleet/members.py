"""The members present in a fleet, according to their liveliness tokens. Uses no sockets."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Final

from pipros_fleet.keys import VERSION, read_live


@dataclass(frozen=True, slots=True, order=True)
class Token:
    """Liveliness token of a running agent. `instance` begins with the start time, so tokens sort by age."""

    member: str
    instance: str
    version: int = VERSION


TOKENS_PER_MEMBER: Final = 4
"""Maximum number of tokens per name: of the running agent, its replacement, and agents that just ended."""


class Members:
    """The set of tokens that are present. For each name, the newest `TOKENS_PER_MEMBER` tokens are kept.

    Thread-safe: Zenoh's threads update the set, and the agent's thread reads it.

    Attributes:
        crowded: names that have had more than `TOKENS_PER_MEMBER` tokens.
    """

    def __init__(self, limit: int) -> None:
        """Create an empty set for at most `limit` names. Up to `limit` tokens of further names can wait."""
        self.crowded: set[str] = set()
        self._waiting: dict[Token, None] = {}
        self._limit = limit
        self._tokens: dict[str, set[Token]] = {}
        self._lock = threading.Lock()

    def update(self, key: str, *, is_present: bool) -> Token | None:
        """Add or remove a token. Return it, or None if nothing changed."""
        found = read_live(key)
        if found is None:
            return None
        member, version, instance = found
        token = Token(member, instance, version)
        with self._lock:
            return self._update(token, is_present=is_present)

    def _update(self, token: Token, *, is_present: bool) -> Token | None:
        member = token.member
        tokens = self._tokens.get(member, set())
        if is_present and token in tokens:
            return None
        if not is_present:
            self._waiting.pop(token, None)
            if token not in tokens:
                return None
            tokens.discard(token)
            if not tokens:
                del self._tokens[member]
            return token
        if not tokens and len(self._tokens) >= self._limit:
            if len(self._waiting) < self._limit:
                self._waiting[token] = None
            return None
        tokens.add(token)
        self._tokens[member] = tokens
        if len(tokens) > TOKENS_PER_MEMBER:
            self.crowded.add(member)
            tokens.discard(min(tokens))
        return token if token in tokens else None

    def admit_waiting(self) -> list[Token]:
        """Add the waiting tokens for which there is room now, and return them."""
        admitted = []
        with self._lock:
            for token in list(self._waiting):
                if token.member not in self._tokens:
                    if len(self._tokens) >= self._limit:
                        continue
                    self._tokens[token.member] = set()
                del self._waiting[token]
                self._tokens[token.member].add(token)
                admitted.append(token)
        return admitted

    def present(self) -> dict[str, Token]:
        """Return each member's newest token with this protocol version, keyed by member."""
        newest = {}
        with self._lock:
            for member, tokens in self._tokens.items():
                fitting = [token for token in tokens if token.version == VERSION]
                if fitting:
                    newest[member] = max(fitting)
        return newest

    def of(self, member: str) -> list[Token]:
        """Return the tokens of one member, oldest first."""
        with self._lock:
            return sorted(self._tokens.get(member, ()))
