"""The verdicts of `hztest` on arrival times."""

from __future__ import annotations

import pytest

from pipros_tools.testing.nodes.hztest import AllowedRate

MS = 1_000_000


def every(gap_ms: int, count: int = 11) -> list[int]:
    return [1_000 * MS + number * gap_ms * MS for number in range(count)]


def test_a_rate_within_its_tolerance_passes() -> None:
    AllowedRate(10, 1).check(every(100), check_intervals=True)
    AllowedRate(10, 1).check(every(92), check_intervals=True)


@pytest.mark.parametrize(("gap_ms", "expected"), [(125, "8.000Hz"), (80, "12.500Hz"), (0, "infHz")])
def test_a_rate_outside_its_tolerance_is_reported_with_the_tolerance(gap_ms: int, expected: str) -> None:
    with pytest.raises(AssertionError, match=f"average rate {expected} is not between 9.000Hz and 11.000Hz"):
        AllowedRate(10, 1).check(every(gap_ms), check_intervals=False)


def test_a_single_gap_matters_only_when_gaps_are_checked() -> None:
    arrivals = [at + (50 * MS if number == 5 else 0) for number, at in enumerate(every(100))]

    AllowedRate(10, 1).check(arrivals, check_intervals=False)
    with pytest.raises(AssertionError, match=r"interval of 0.150s does not match 9.000Hz to 11.000Hz"):
        AllowedRate(10, 1).check(arrivals, check_intervals=True)


def test_a_tolerance_as_large_as_the_rate_allows_any_gap() -> None:
    AllowedRate(1, 1).check(every(100_000, 2), check_intervals=True)


@pytest.mark.parametrize(
    ("count", "expected"), [(0, "no messages received"), (1, "only one message received")]
)
def test_one_message_has_no_rate(count: int, expected: str) -> None:
    with pytest.raises(AssertionError, match=expected):
        AllowedRate(10, 1).check(every(100, count), check_intervals=False)


def test_silence_is_broken_by_one_message() -> None:
    AllowedRate(0, 0).check([], check_intervals=False)
    with pytest.raises(AssertionError, match="expected no messages, received 1"):
        AllowedRate(0, 0).check(every(100, 1), check_intervals=False)
