"""Divide a server's memory and topics among its clients. Performs no I/O.

If all clients shared a limit, one client could use up everything. Here, each client has its own share, and
may use at most half of what the other clients leave free. `ClientShares.close` gives back everything that a
client still holds.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import Final

from pipros.basics.budget import Budget
from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits
from pipros_bridges.limits import BridgeLimits

BRIDGE_TOPICS = 1000
"""Limit: topics that all clients of one protocol receive together; also topics that all rosbridge clients
publish together. Beyond it, the subscription is refused; a client can use at most half of the topics that
other clients leave free, but always eight.
"""
BRIDGE_SUBSCRIPTIONS = 2000
"""Limit: subscriptions of one client; also the topics and services that it advertises. Beyond it, the
subscription or advertisement is refused.
"""
BRIDGE_READER_BYTES = 1024 * 1024
"""Limit: a message from a client that may not change the system. Beyond it, like `bridge_message_bytes`, for
a client that may only read.
"""
BRIDGE_PARSED_BYTES = 32 * 1024 * 1024
"""Limit: the approximate memory for a client's parsed message, and also for the requests of its pending
service calls; a quarter of it for a client that may not change the system. In addition, the memory for a
client's published messages that are kept for later subscribers. Beyond it, the message is refused before it
is parsed, because many small values need far more memory than their text. The same limit applies to the
total of a client's latched messages and of the messages that wait up to a second for the first subscriber:
if it is exceeded, a further latched message is refused, and other messages are sent at once.
"""
BRIDGE_KEPT_BYTES = 4 * 1024 * 1024
"""Limit: the names and ids that a server stores for one client. Beyond it, the request is refused; the
client is disconnected if it continues.
"""
BRIDGE_CLIENT_BYTES = 48 * 1024 * 1024
"""Limit: everything that a server holds for one client: incomplete, parsed, queued and latched messages,
names and ids. The sum of `bridge_queue_bytes` and three times `bridge_message_bytes` applies instead if it
is larger. Beyond it, the client misses its oldest messages, or is disconnected.
"""
BRIDGE_TOTAL_BYTES = 160 * 1024 * 1024
"""Limit: the same for all clients of a server together, in addition to 256 KiB per client. Twice the sum
above applies instead if it is larger. A client may use at most half of the memory that the other clients
leave free. Beyond it, like `BRIDGE_CLIENT_BYTES`, for all clients together; a client can use at most half of
the memory that other clients leave free, but always 256 KiB. Latched messages are kept for 10 s after their
client has left; all clients that have left may together keep as much as one client.
"""

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
                    f"{int(self._topics.used)}; the limit is {self._limit}"
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
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        largest = (
            limits.of(BridgeLimits).bridge_queue_bytes + 3 * limits.of(BridgeLimits).bridge_message_bytes
        )
        self.client_bytes = max(BRIDGE_CLIENT_BYTES, largest)
        self.memory = Budget(max(BRIDGE_TOTAL_BYTES, 2 * largest))
        self.left_behind = Budget(self.client_bytes, self.memory, part=PART)

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
            self.message_bytes = min(BRIDGE_READER_BYTES, limits.of(BridgeLimits).bridge_message_bytes)
        parsed = BRIDGE_PARSED_BYTES // 4 if is_reader else BRIDGE_PARSED_BYTES
        self.memory = Budget(server.client_bytes, server.memory, part=PART, own=OWN_BYTES)
        self.input = Budget(2 * self.message_bytes + 4 * READ_AHEAD_BYTES, self.memory)
        self.kept = Budget(BRIDGE_KEPT_BYTES, self.memory)
        self.parsed = Budget(parsed, self.memory)
        self.calls = Budget(parsed, self.memory)
        self.queue = Budget(limits.of(BridgeLimits).bridge_queue_bytes, self.memory)
        self.messages = Budget(BRIDGE_PARSED_BYTES, self.memory)
        self.left_behind = server.left_behind
        self._kept_limit = BRIDGE_KEPT_BYTES

    def keep(self, size_bytes: int) -> None:
        """Count memory that the server keeps because of a request.

        Raises:
            LimitExceeded: the client exceeds its share for the first time, or other clients have used up the
                memory.
            ExceedsShare: the client has exceeded its share before.
        """
        if not self.kept.take(size_bytes):
            limit = f"the limit is {self._kept_limit} bytes"
            text = f"this client makes the server keep too much; {limit}"
            raise ExceedsShare(text) if self.kept.refusals > PATIENCE else LimitExceeded(text)

    @contextmanager
    def keeping(self, size_bytes: int) -> Iterator[None]:
        """Count memory like `keep`, unless what the request asks for fails."""
        self.keep(size_bytes)
        try:
            yield
        except BaseException:
            self.release(size_bytes)
            raise

    def release(self, size_bytes: int) -> None:
        """Stop counting memory that the server no longer keeps."""
        self.kept.give_back(size_bytes)

    def close(self) -> None:
        """Give everything back, because the client has left. May be called repeatedly."""
        self.memory.close()
