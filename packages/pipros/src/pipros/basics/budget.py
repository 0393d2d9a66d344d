"""Budgets for the resources that a process spends on its peers, with a share for each peer.

Theory of operation. A single limit on all peers together protects the process, but does not protect peers
from each other. Therefore, budgets form a tree: the root belongs to the server, each client has a child, and
a child may have children for single topics or requests. An amount is taken from a budget and all its
ancestors, or from none of them. Closing a client's budget returns everything that the client still
holds, so no amount can leak when a client disconnects.

The caller chooses the unit, such as bytes, threads or slots. All budgets of a tree are thread-safe, and
`take` never blocks.

    server = Budget(256 * MIB)
    client = Budget(64 * MIB, server, part=0.5)
    if not client.take(len(data)):
        ...  # tell the client if `client.refusals` is 1, otherwise disconnect it
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Hashable


class Budget:
    """An amount that one peer, or all peers together, may use.

    Attributes:
        limit: maximum amount in use.
        used: the amount in use, including that of all children.
        peak: the largest `used` so far.
        refusals: number of times that `take` or `hold` failed because of this budget's own limit, not because
            others have used up the parent.
    """

    __slots__ = ("_is_closed", "_lock", "_own", "_parent", "_part", "limit", "peak", "refusals", "used")

    def __init__(
        self, limit: float, parent: Budget | None = None, *, part: float = 1.0, own: float = 0
    ) -> None:
        """Create an unused budget.

        Args:
            limit: maximum amount in use.
            parent: budget from which each amount is also taken.
            part: maximum fraction, above 0 and at most 1, of the amount in `parent` that the other children
                do not use. With 0.5, any number of greedy children leave room for the next one.
            own: amount that is not taken from `parent`, so that other children cannot use it up.
        """
        if limit < 0 or not 0 < part <= 1:
            raise ValueError(
                f"limit must be >= 0 and part must be above 0 and at most 1, got {limit} and {part}"
            )
        self.limit = limit
        self.used: float = 0
        self.peak: float = 0
        self.refusals = 0
        self._parent = parent
        self._part = part
        self._own = own
        self._is_closed = False
        # reentrant, because a finalizer may return an amount while this thread takes one
        self._lock: threading.RLock = threading.RLock() if parent is None else parent._lock

    @property
    def left(self) -> float:
        """The amount that `take` would still grant."""
        with self._lock:
            return self._left()

    def take(self, amount: float) -> bool:
        """Use an amount, here and in all ancestors. Return False, and use nothing, if too little is left."""
        with self._lock:
            return self._take(amount)

    def charge(self, amount: float) -> None:
        """Use an amount even if too little is left, for a resource that has already been used.

        Until the amount is returned, `take` grants that much less.
        """
        with self._lock:
            if not self._is_closed:
                self._add(amount)

    def give_back(self, amount: float) -> None:
        """Return an amount that was taken or charged. Do nothing once the budget is closed.

        Raises:
            ValueError: the amount is negative or exceeds the amount in use.
        """
        with self._lock:
            if not self._is_closed:
                self._give_back(amount)

    def hold(self, before: float, after: float) -> bool:
        """Change an amount in use from `before` to `after`, for example when a stored value is replaced.

        Return False, and change nothing, if too little is left.
        """
        with self._lock:
            if after > before:
                return self._take(after - before)
            if not self._is_closed:
                self._give_back(before - after)
            return True

    def close(self) -> None:
        """Return everything in use, and refuse all later amounts. May be called repeatedly."""
        with self._lock:
            if not self._is_closed:
                self._give_back(self.used)
                self._is_closed = True

    def _left(self) -> float:
        if self._is_closed:
            return 0
        left = self.limit - self.used
        if self._parent is not None:
            shared = self._shared(self.used)
            others = self._parent.used - shared
            part = self._part * (self._parent.limit - others) - shared
            own = max(self._own - self.used, 0)
            left = min(left, own + max(min(part, self._parent._left()), 0))
        return max(left, 0)

    def _shared(self, used: float) -> float:
        """Return the part of `used` that has been taken from the parent."""
        return max(used - self._own, 0)

    def _take(self, amount: float) -> bool:
        if amount < 0:
            raise ValueError(f"amount must be >= 0, got {amount}")
        if amount > self._left():
            self.refusals += not self._is_closed and amount > self.limit - self.used
            return False
        self._add(amount)
        return True

    def _add(self, amount: float) -> None:
        before = self._shared(self.used)
        self.used += amount
        self.peak = max(self.peak, self.used)
        if self._parent is not None and not self._parent._is_closed:
            self._parent._add(self._shared(self.used) - before)

    def _give_back(self, amount: float) -> None:
        if not 0 <= amount <= self.used:
            raise ValueError(f"amount must be between 0 and {self.used}, got {amount}")
        before = self._shared(self.used)
        self.used -= amount
        if self._parent is not None and not self._parent._is_closed:
            self._parent._give_back(before - self._shared(self.used))


class SharedBudget:
    """A budget of several users, each of which can use at most half of what the others leave. Thread-safe."""

    def __init__(self, limit: float) -> None:
        self._whole = Budget(limit)
        self._users: dict[Hashable, Budget] = {}

    def take(self, user: Hashable, amount: float = 1) -> bool:
        """Use an amount for a user. Return False, and use nothing, if too little is left for this user."""
        with self._whole._lock:
            budget = self._users.get(user) or Budget(self._whole.limit, self._whole, part=0.5)
            is_taken = budget.take(amount)
            if is_taken:
                self._users[user] = budget
            return is_taken

    def give_back(self, user: Hashable, amount: float = 1) -> None:
        """Return an amount that the user has taken."""
        with self._whole._lock:
            budget = self._users[user]
            budget.give_back(amount)
            if not budget.used:
                del self._users[user]


class Slots:
    """A limited number of slots, which are acquired without blocking. Faster than a semaphore."""

    def __init__(self, count: int) -> None:
        self._free = deque([None] * count)

    def try_acquire(self) -> bool:
        """Acquire a slot; return False if none is free."""
        try:
            self._free.pop()
        except IndexError:
            return False
        return True

    def release(self) -> None:
        self._free.append(None)
