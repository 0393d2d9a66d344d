"""Time and Duration. All operators are compared with genpy's in tests.interop."""

from collections.abc import Callable
from fractions import Fraction

import numpy
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


def test_it_is_written_like_that_of_genpy() -> None:
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
def test_integer_multiples_are_exact(total: int, factor: int) -> None:
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


def test_the_operators_are_genpys() -> None:
    assert (Duration(7) / Duration(2), Duration(5) / 2) == (3.5, Duration(2.5))
    assert (Duration(7) // Duration(2), Duration(7) // 2) == (3, Duration(3))
    assert Duration(7.5) % Duration(2) == Duration(1.5)
    assert divmod(Duration(7.5), Duration(2)) == (3, Duration(1.5))
    assert (Duration(3) * 0.5, 2 * Duration(1.25)) == (Duration(1.5), Duration(2.5))
    assert (-Duration(1.5), abs(Duration(-1.5)), abs(Duration(1.5))) == (
        Duration(-2, 500_000_000), Duration(1.5), Duration(1.5),
    )  # fmt: skip
    assert (Duration(1) + Time(2), Time(3) - Duration(1)) == (Time(3), Time(2))


@pytest.mark.parametrize(
    "operation",
    [
        lambda: Duration(1) + 1,  # type: ignore[operator]
        lambda: Duration(1) - 1,  # type: ignore[operator]
        lambda: Duration(1) * "1",  # type: ignore[operator]
        lambda: Duration(1) / "1",
        lambda: Duration(1) // "1",
        lambda: Duration(1) % 1,  # type: ignore[operator]
        lambda: divmod(Duration(1), 1),  # type: ignore[operator]
        lambda: Time(1) - 1,  # type: ignore[call-overload]
        lambda: Time(1) + 1,  # type: ignore[operator]
    ],
    ids=["+", "-", "*", "/", "//", "%", "divmod", "instant -", "instant +"],
)
def test_a_value_that_is_not_a_time_is_refused(operation: Callable[[], object]) -> None:
    with pytest.raises(TypeError):
        operation()


def test_numbers_of_other_kinds_are_numbers() -> None:
    assert Time(numpy.int64(3), numpy.int32(5)) == Time(3, 5)
    assert (Time(Fraction(3, 2)), Duration(1) * Fraction(3, 2)) == (Time(1.5), Duration(1.5))


def test_comparison_returns_minus_one_zero_or_one() -> None:
    assert [Time(2).__cmp__(Time(secs)) for secs in (1, 2, 3)] == [1, 0, -1]
    with pytest.raises(TypeError, match="annot compare to non-Time"):
        Time(2).__cmp__(Duration(2))


def test_instants_are_ordered_and_spans_are_ordered() -> None:
    assert Time(1) <= Time(1) < Time(2) > Time(1) >= Time(1)
    assert Duration(-1) <= Duration(-1) < Duration(0) > Duration(-1) >= Duration(-1)


def test_seconds_and_nanoseconds_may_be_set_and_brought_in_order() -> None:
    value = Time()
    assert value.is_zero()
    assert not value
    value.set(1, 2_500_000_000)
    value.canon()
    assert (value.secs, value.nsecs, value.to_time()) == (3, 500_000_000, 3.5)
    assert value


def test_equal_values_are_one_key() -> None:
    assert ({Time(1, 5): "a"}[Time(1, 5)], len({Duration(1), Duration(0, 10**9)})) == ("a", 1)
