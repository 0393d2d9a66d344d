"""Divide a server's memory and topics among its clients. Performs no I/O.

If all clients shared a limit, one client could use up everything. Here, each client has its own share, and
may use at most half of what the other clients leave free. `ClientShares.close` gives back everything that a
client still holds.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Final

from pipros.basics.budget import Budget
from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits, limit_text
from pipros.bridges.limits import BridgeLimits
from pipros.bridges.pace import SharedWork

PART: Final = 0.5
"""One client gets at most this part of what the other clients leave free."""
OWN_BYTES: Final = 256 * 1024
"""Memory that each client has regardless of the other clients."""
OWN_TOPICS: Final = 8
"""Number of topics that each client may receive regardless of the other clients."""
READ_AHEAD_BYTES: Final = 256 * 1024
"""Maximum size of the complete messages that a server reads before it has handled earlier messages."""
PATIENCE: Final = 1
"""Number of refusals after which a client that exceeds its share again is disconnected."""


class ExceedsShare(LimitExceeded):
    """A client exceeds its share again, although it has received an error. It should be disconnected."""


class TopicShares:
    """Counts the topics of all users. Not thread-safe.

    A topic counts for its first user until this user leaves the topic, and then for another user.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._topics = Budget(limit)
        self._budgets: dict[Hashable, Budget] = {}
        self._users: dict[str, dict[Hashable, int]] = {}  # a topic's first user is charged for it

    def enter(self, topic: str, user: Hashable) -> None:
        """Count a topic for a user. A user may enter a topic repeatedly, and must leave it as often.

        Raises:
            LimitExceeded: another topic would exceed the user's share of topics.
        """
        users = self._users.get(topic)
        if users is None:
            budget = self._budgets.get(user)
            if budget is None:
                budget = self._budgets[user] = Budget(self._limit, self._topics, part=PART, own=OWN_TOPICS)
            if not budget.take(1):
                self._forget_unused(user)
                raise LimitExceeded(
                    f"too many topics: this client has {int(budget.used)}, and all clients together "
                    f"{int(self._topics.used)}; {limit_text('bridge_topics', self._limit)}"
                )
            users = self._users[topic] = {}
        users[user] = users.get(user, 0) + 1

    def leave(self, topic: str, user: Hashable) -> bool:
        """Undo one `enter`. Return whether the topic no longer has users."""
        users = self._users[topic]
        users[user] -= 1
        if users[user]:
            return False
        was_counted = next(iter(users)) is user
        del users[user]
        if was_counted:
            self._budgets[user].give_back(1)
            self._forget_unused(user)
        if not users:
            del self._users[topic]
            return True
        if was_counted:
            heir = next(iter(users))
            if heir not in self._budgets:
                self._budgets[heir] = Budget(self._limit, self._topics, part=PART, own=OWN_TOPICS)
            self._budgets[heir].charge(1)
        return False

    def __contains__(self, topic: object) -> bool:
        """Return whether any user has entered a topic and not left it."""
        return topic in self._users

    def counts(self) -> Mapping[str, int]:
        """Return, for each topic, the number of `enter` calls not yet undone by `leave`."""
        return {topic: sum(users.values()) for topic, users in self._users.items()}

    def _forget_unused(self, user: Hashable) -> None:
        if not self._budgets[user].used:
            del self._budgets[user]


class Charge:
    """An amount that counts against one budget and can be moved to another. Not thread-safe."""

    __slots__ = ("_amount", "budget")

    def __init__(self, budget: Budget, amount: float) -> None:
        """Begin with an amount that has been taken from `budget`."""
        self.budget = budget
        self._amount = amount

    def change(self, amount: float) -> bool:
        """Change the amount. Return False, and change nothing, if too little is left."""
        if not self.budget.hold(self._amount, amount):
            return False
        self._amount = amount
        return True

    def pass_to(self, budget: Budget, *, is_forced: bool = False) -> bool:
        """Move the amount to another budget. Unless `is_forced`, return False if too little is left there."""
        if is_forced:
            budget.charge(self._amount)
        elif not budget.take(self._amount):
            return False
        self.budget.give_back(self._amount)
        self.budget = budget
        return True

    def end(self) -> None:
        """Give the amount back."""
        self.budget.give_back(self._amount)
        self._amount = 0


class ServerShares:
    """Resources that all clients of a server share.

    Attributes:
        memory: everything that the server holds for its clients.
        left_behind: the part of `memory` for published messages of clients that have left.
        work: the clients that keep the server busy.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        largest = (
            limits.of(BridgeLimits).bridge_queue_bytes + 3 * limits.of(BridgeLimits).bridge_message_bytes
        )
        self.client_bytes = max(limits.of(BridgeLimits).bridge_client_bytes, largest)
        self.memory = Budget(max(limits.of(BridgeLimits).bridge_total_bytes, 2 * largest))
        self.left_behind = Budget(self.client_bytes, self.memory, part=PART)
        self.work = SharedWork()

    def client(self, *, is_reader: bool = False) -> ClientShares:
        """Return the shares of a new client."""
        return ClientShares(self, is_reader=is_reader)


class ClientShares:
    """Resources that one client may use. Thread-safe.

    Attributes:
        message_bytes: maximum size of a message from the client.
        memory: everything that the server holds for the client. The budgets below, except `left_behind`,
            are parts of it.
        input: messages from the client that are incomplete or have not been handled.
        kept: names and ids that the server stores for the client.
        parsed: approximate memory for the client's current message, once parsed.
        calls: approximate memory for the requests of pending service calls.
        queue: messages and responses that the client has not read.
        messages: messages that the client has published and that are kept for later subscribers.
        left_behind: messages of clients that have left; shared by all clients.
    """

    def __init__(self, server: ServerShares, *, is_reader: bool) -> None:
        limits = server.limits
        self.is_reader = is_reader
        self.message_bytes = limits.of(BridgeLimits).bridge_message_bytes
        if is_reader:
            self.message_bytes = min(
                limits.of(BridgeLimits).bridge_reader_bytes, limits.of(BridgeLimits).bridge_message_bytes
            )
        parsed = (
            limits.of(BridgeLimits).bridge_parsed_bytes // 4
            if is_reader
            else limits.of(BridgeLimits).bridge_parsed_bytes
        )
        self.memory = Budget(server.client_bytes, server.memory, part=PART, own=OWN_BYTES)
        self.input = Budget(2 * self.message_bytes + 4 * READ_AHEAD_BYTES, self.memory)
        self.kept = Budget(limits.of(BridgeLimits).bridge_kept_bytes, self.memory)
        self.parsed = Budget(parsed, self.memory)
        self.calls = Budget(parsed, self.memory)
        self.queue = Budget(limits.of(BridgeLimits).bridge_queue_bytes, self.memory)
        self.messages = Budget(limits.of(BridgeLimits).bridge_parsed_bytes, self.memory)
        self.left_behind = server.left_behind
        self._kept_limit = limits.of(BridgeLimits).bridge_kept_bytes

    def keep(self, size_bytes: int) -> None:
        """Count memory that the server keeps because of a request.

        Raises:
            LimitExceeded: the client exceeds its share for the first time, or other clients have used up the
                memory.
            ExceedsShare: the client has exceeded its share before.
        """
        if not self.kept.take(size_bytes):
            limit = limit_text("bridge_kept_bytes", self._kept_limit)
            text = f"this client makes the server keep too much; {limit}"
            raise ExceedsShare(text) if self.kept.refusals > PATIENCE else LimitExceeded(text)

    def release(self, size_bytes: int) -> None:
        """Stop counting memory that the server no longer keeps."""
        self.kept.give_back(size_bytes)

    def close(self) -> None:
        """Give everything back, because the client has left. May be called repeatedly."""
        self.memory.close()
