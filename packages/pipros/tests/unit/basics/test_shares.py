"""Fair division of a limit."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.shares import fair_shares


def test_one_who_wants_everything_leaves_the_others_what_they_want() -> None:
    assert fair_shares({"large": 6_000, "a": 10, "b": 20}, 5_000) == {"large": 4_970, "a": 10, "b": 20}
    assert fair_shares({"large": 6_000, "other": 6_000}, 5_000) == {"large": 2_500, "other": 2_500}
    assert fair_shares({}, 5_000) == {}


@given(st.dictionaries(st.integers(), st.integers(0, 100), max_size=10), st.integers(0, 300))
def test_no_one_gets_less_than_another_who_got_more_than_wanted(wanted: dict[int, int], limit: int) -> None:
    shares = fair_shares(wanted, limit)

    assert shares.keys() == wanted.keys()
    assert sum(shares.values()) == min(limit, sum(wanted.values()))
    for user, share in shares.items():
        assert share <= wanted[user]
        if share < wanted[user]:  # at most one less than any other, by rounding
            assert share >= max(shares.values()) - 1
