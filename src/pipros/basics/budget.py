"""Budgets for what peers make a process keep or do, with a share for each peer.

Theory of operation. A limit that all peers share without shares of their own protects the process from them,
but not one peer from another. Therefore, budgets form a tree: the root is the server's, each client has a
child, and a child may have children for single topics or requests. An amount is taken from a budget and from
all its ancestors, or from none of them. Closing a client's budget returns everything that the client still
holds, so no path through the code can forget an amount when a client leaves.

The unit is the caller's: bytes, threads, slots or steps of work. Work is a budget that is refilled, at each
turn of an event loop or after some time. All budgets of a tree are thread-safe, and `take` never blocks.

    server = Budget(256 * MIB)
    client = Budget(64 * MIB, server, part=0.5)
    if not client.take(len(data)):
        ...  # tell the client if `client.refusals` is 1, otherwise disconnect it
"""

from __future__ import annotations

import threading


class Budget:
    """An amount that one peer, or all peers together, may use.

    Attributes:
        limit: maximum amount in use.
        used: the amount in use, including that of all children.
        peak: the largest `used` so far.
        refusals: how often `take` or `hold` failed because of this budget's own limit, and not because others
            have used up the parent.
    """

    __slots__ = ("_is_closed", "_lock", "_parent", "_part", "limit", "peak", "refusals", "used")

    def __init__(self, limit: float, parent: Budget | None = None, *, part: float = 1.0) -> None:
        """Create an unused budget.

        Args:
            limit: maximum amount in use.
            parent: budget from which each amount is also taken.
            part: largest part, from 0 to 1, of what the other children leave of `parent`. With 0.5, any
                number of greedy children leave room for the next one.
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
        self._is_closed = False
        self._lock: threading.Lock = threading.Lock() if parent is None else parent._lock

    @property
    def left(self) -> float:
        """The amount that `take` would still grant."""
        with self._lock:
            return self._left()

    def take(self, amount: float) -> bool:
        """Use an amount, here and in all ancestors. Return False, and use nothing, if too little is left."""
        with self._lock:
            return self._take(amount)

    def give_back(self, amount: float) -> None:
        """Return an amount for which `take` returned True. Do nothing once the budget is closed.

        Raises:
            ValueError: the amount exceeds what is in use.
        """
        with self._lock:
            if not self._is_closed:
                self._give_back(amount)

    def hold(self, before: float, after: float) -> bool:
        """Change an amount in use, for example when something known is replaced by a larger version.

        Return False, and change nothing, if too little is left.
        """
        with self._lock:
            if after > before:
                return self._take(after - before)
            if not self._is_closed:
                self._give_back(before - after)
            return True

    def refill(self) -> None:
        """Return everything in use, for example at the next turn of an event loop.

        Only for budgets without children, which would return the same amounts again.
        """
        with self._lock:
            if not self._is_closed:
                self._give_back(self.used)

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
            others = self._parent.used - self.used
            part = self._part * (self._parent.limit - others) - self.used
            left = min(left, part, self._parent._left())
        return max(left, 0)

    def _take(self, amount: float) -> bool:
        if amount < 0:
            raise ValueError(f"amount must be >= 0, got {amount}")
        if amount > self._left():
            self.refusals += not self._is_closed and amount > self.limit - self.used
            return False
        self._add(amount)
        return True

    def _add(self, amount: float) -> None:
        self.used += amount
        self.peak = max(self.peak, self.used)
        if self._parent is not None:
            self._parent._add(amount)

    def _give_back(self, amount: float) -> None:
        if not 0 <= amount <= self.used:
            raise ValueError(f"amount must be between 0 and {self.used}, got {amount}")
        self.used -= amount
        if self._parent is not None and not self._parent._is_closed:
            self._parent._give_back(amount)
