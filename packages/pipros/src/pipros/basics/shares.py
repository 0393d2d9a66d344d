"""Fair division of a limit among users who want different amounts."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import TypeVar

User = TypeVar("User", bound=Hashable)


def fair_shares(wanted: Mapping[User, int], limit: int) -> dict[User, int]:
    """Divide `limit` among users. Users who get less than requested get equal shares, to within one unit.

    Users who want less than an equal share leave the rest to the others (max-min fairness).

    >>> fair_shares({"a": 2, "b": 9, "c": 7}, 12)
    {'a': 2, 'c': 5, 'b': 5}
    """
    shares = {}
    for index, user in enumerate(sorted(wanted, key=lambda each: wanted[each])):
        shares[user] = min(wanted[user], limit // (len(wanted) - index))
        limit -= shares[user]
    return shares
