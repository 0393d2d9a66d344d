"""Time and Duration. All operators are compared with genpy's in tests/interop."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import genpy
from pipros.msg.time import Duration, Time, TVal

nanoseconds = st.integers(-(10**18), 10**18)


def duration(total: int) -> Duration:
    return Duration(0, total)


def test_genpy_gives_these_classes() -> None:
    assert (genpy.Time, genpy.Duration, genpy.TVal) == (Time, Duration, TVal)


def test_it_is_written_as_genpys() -> None:
    assert repr(Time(1, 5)) == "genpy.Time[1000000005]"
    assert str(Duration(-1, 5)) == "-999999995"


@given(nanoseconds)
def test_nanoseconds_lie_within_a_second(total: int) -> None:
    value = duration(total)
    assert 0 <= value.nsecs < 10**9
    assert value.to_nsec() == total


@given(nanoseconds, nanoseconds)
def test_addition_is_exact(first: int, second: int) -> None:
    assert (duration(first) + duration(second)).to_nsec() == first + second
    assert (duration(first) - duration(second)).to_nsec() == first - second


@given(nanoseconds, nanoseconds)
def test_order_is_that_of_the_nanoseconds(first: int, second: int) -> None:
    assert (duration(first) < duration(second)) is (first < second)
    assert (duration(first) == duration(second)) is (first == second)


@given(nanoseconds, st.integers(-1000, 1000))
def test_whole_multiples_are_exact(total: int, factor: int) -> None:
    assert (duration(total) * factor).to_nsec() == total * factor


def test_arithmetic_keeps_the_class_of_its_left_operand() -> None:
    class RobotTime(Time):
        pass

    assert type(RobotTime(3) + Duration(1)) is RobotTime
    assert type(RobotTime(3) - RobotTime(1)) is Duration


def test_an_instant_before_zero_is_refused() -> None:
    with pytest.raises(TypeError, match="time values must be positive"):
        Time(-1)
    with pytest.raises(TypeError, match="time values must be positive"):
        Time(1) - Duration(2)


def test_instants_and_spans_do_not_mix() -> None:
    assert Time(1) != Duration(1)
    with pytest.raises(TypeError):
        Time(1) < Duration(1)  # noqa: B015
    with pytest.raises(TypeError):
        Time(1) + Time(1)  # type: ignore[operator]


def test_float_seconds_and_nanoseconds_together_are_refused() -> None:
    with pytest.raises(ValueError, match="if secs is a float, nsecs cannot be set"):
        Time(1.5, 5)


def test_no_attribute_can_be_added() -> None:
    with pytest.raises(AttributeError):
        Time().seconds = 1  # type: ignore[attr-defined]
