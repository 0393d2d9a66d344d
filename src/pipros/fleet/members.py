"""The members present in a fleet, according to their liveliness tokens. No sockets."""

from __future__ import annotations

from dataclasses import dataclass

from pipros.fleet.keys import VERSION, read_live


@dataclass(frozen=True, slots=True, order=True)
class Token:
    """Liveliness token of a running agent. `instance` begins with its start time; older agents sort first."""

    member: str
    instance: str
    version: int = VERSION


class Members:
    """The set of tokens that are present."""

    def __init__(self, limit: int) -> None:
        """`limit`: maximum number of tokens; further ones are ignored."""
        self._limit = limit
        self._tokens: set[Token] = set()

    def update(self, key: str, *, is_present: bool) -> Token | None:
        """Add or remove a token. Return it, or None if nothing changed."""
        found = read_live(key)
        if found is None:
            return None
        member, version, instance = found
        token = Token(member, instance, version)
        if is_present == (token in self._tokens) or (is_present and len(self._tokens) >= self._limit):
            return None
        (self._tokens.add if is_present else self._tokens.discard)(token)
        return token

    def present(self) -> dict[str, Token]:
        """Return each member's newest token with this protocol version, keyed by member."""
        return {token.member: token for token in sorted(self._tokens) if token.version == VERSION}

    def of(self, member: str) -> list[Token]:
        """Return the tokens of one member, oldest first."""
        return sorted(token for token in self._tokens if token.member == member)
