"""A queue that serves its users in turn, so that a user with many items does not delay the others."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

User = TypeVar("User", bound=Hashable)
Item = TypeVar("Item")


class Turns(Generic[User, Item]):
    """A queue of items for each user. `pop` takes one item from each user in turn, in the order of arrival.

    Every method takes constant time, except `forget`, which takes time proportional to the number of removed
    items. Not thread-safe.
    """

    def __init__(self) -> None:
        self._queues: OrderedDict[User, deque[Item]] = OrderedDict()  # next user first; no queue is empty
        self._count = 0

    def __len__(self) -> int:
        """Return the number of items of all users together."""
        return self._count

    def waiting(self, user: User) -> int:
        """Return the number of a user's items."""
        return len(self._queues.get(user, ()))

    def put(self, user: User, item: Item) -> None:
        """Append an item to a user's queue. A user without items gets the last turn."""
        self._queues.setdefault(user, deque()).append(item)
        self._count += 1

    def pop(self, may: Callable[[User], bool] | None = None) -> tuple[User, Item]:
        """Remove and return the first item of the user whose turn it is, of the users that `may` admits.

        Raises:
            IndexError: these users have no items.
        """
        for user in self._queues:
            if may is None or may(user):
                break
        else:
            raise IndexError("pop from empty turns")
        queue = self._queues.pop(user)
        item = queue.popleft()
        self._count -= 1
        if queue:
            self._queues[user] = queue
        return user, item

    def forget(self, user: User) -> list[Item]:
        """Remove and return all items of a user."""
        removed = list(self._queues.pop(user, ()))
        self._count -= len(removed)
        return removed
