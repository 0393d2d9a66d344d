"""`Time` and `Duration`: seconds and nanoseconds, as in genpy.

`secs` and `nsecs` are plain attributes that callers may set. `canon()` restores 0 <= nsecs < 1e9.
A time plus or minus a duration has the time's class, so adding to a `rospy.Time` gives a `rospy.Time`.
"""

from __future__ import annotations

# Type checkers treat this as True. Importing `typing` would double the time of the first message import.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar, TypeVar, overload

    Value = TypeVar("Value", bound="TVal")
    DurationValue = TypeVar("DurationValue", bound="Duration")
    TimeValue = TypeVar("TimeValue", bound="Time")

NS_PER_S = 1_000_000_000


def _is_integral(value: object) -> bool:
    """Return True for integers, including numpy's."""
    if isinstance(value, int | float):
        return isinstance(value, int)
    import numbers  # most programs do not need this module

    return isinstance(value, numbers.Integral)


def _is_real(value: object) -> bool:
    """Return True for real numbers, including the types of numpy and `fractions`."""
    if isinstance(value, int | float):
        return True
    import numbers

    return isinstance(value, numbers.Real)


class TVal:
    """Base class of `Time` and `Duration`."""

    __module__ = "genpy.rostime"  # the module named in pickles, including pickles from genuine ROS

    __slots__: ClassVar[list[str]] = ["secs", "nsecs"]  # noqa: RUF023 # the order of the wire
    _slot_types: ClassVar[list[str]] = ["int32", "int32"]

    _kind: ClassVar[type[TVal]]
    """Values can only be compared with instances of this class and of its subclasses."""

    secs: int
    nsecs: int

    def __init__(self, secs: Any = 0, nsecs: Any = 0) -> None:
        """Set whole seconds and nanoseconds, or only seconds with a fraction.

        Raises:
            ValueError: `secs` is a float, and `nsecs` is not zero.
        """
        self.secs = int(secs)
        if type(secs) is int or _is_integral(secs):
            self.nsecs = int(nsecs)
        elif nsecs != 0:
            raise ValueError("if secs is a float, nsecs cannot be set")
        else:
            self.nsecs = int((secs - self.secs) * NS_PER_S)
        if not 0 <= self.nsecs < NS_PER_S:
            self.canon()

    @classmethod
    def from_sec(cls: type[Value], float_secs: float) -> Value:
        secs = int(float_secs)
        return cls(secs, int((float_secs - secs) * NS_PER_S))

    def is_zero(self) -> bool:
        return self.secs == 0 and self.nsecs == 0

    def set(self, secs: int, nsecs: int) -> None:
        self.secs = secs
        self.nsecs = nsecs

    def canon(self) -> None:
        """Normalize `nsecs` to 0 <= nsecs < 1e9, and carry the excess over to `secs`."""
        carry, self.nsecs = divmod(self.nsecs, NS_PER_S)
        self.secs += carry

    def to_sec(self) -> float:
        return float(self.secs) + float(self.nsecs) / 1e9

    def to_nsec(self) -> int:
        return self.secs * NS_PER_S + self.nsecs

    def __getstate__(self) -> list[int]:
        return [self.secs, self.nsecs]

    def __setstate__(self, state: list[int]) -> None:
        self.secs, self.nsecs = state

    def __hash__(self) -> int:
        return hash((self.secs, self.nsecs))

    def __str__(self) -> str:
        return str(self.to_nsec())

    def __repr__(self) -> str:
        return f"genpy.{self._kind.__name__}[{int(self.to_nsec())}]"

    def __bool__(self) -> bool:
        return not self.is_zero()

    __nonzero__ = __bool__

    def __cmp__(self, other: object) -> int:
        """Compare with another value, and return -1, 0 or 1.

        Raises:
            TypeError: the values cannot be compared, for example a time and a duration.
        """
        if not isinstance(other, self._kind):
            raise TypeError(f"Cannot compare to non-{self._kind.__name__}")
        mine, others = self.to_nsec(), other.to_nsec()
        return (mine > others) - (mine < others)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, self._kind):
            return False
        return self.secs == other.secs and self.nsecs == other.nsecs

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __lt__(self, other: object) -> bool:
        return self.to_nsec() < other.to_nsec() if isinstance(other, self._kind) else NotImplemented

    def __le__(self, other: object) -> bool:
        return self.to_nsec() <= other.to_nsec() if isinstance(other, self._kind) else NotImplemented

    def __gt__(self, other: object) -> bool:
        return self.to_nsec() > other.to_nsec() if isinstance(other, self._kind) else NotImplemented

    def __ge__(self, other: object) -> bool:
        return self.to_nsec() >= other.to_nsec() if isinstance(other, self._kind) else NotImplemented


TVal._kind = TVal


class Time(TVal):
    """A point in time; never negative.

    Raises:
        TypeError: the time, or the result of an arithmetic operation, is negative.
    """

    __module__ = "genpy.rostime"

    __slots__: ClassVar[list[str]] = ["secs", "nsecs"]  # noqa: RUF023 # the order of the wire

    def __init__(self, secs: Any = 0, nsecs: Any = 0) -> None:
        if secs.__class__ is int and nsecs.__class__ is int and 0 <= nsecs < NS_PER_S and secs >= 0:
            self.secs = secs
            self.nsecs = nsecs
            return
        super().__init__(secs, nsecs)
        if self.secs < 0:
            raise TypeError("time values must be positive")

    def to_time(self) -> float:
        return self.to_sec()

    def __add__(self: TimeValue, other: Duration) -> TimeValue:
        if not isinstance(other, Duration):
            return NotImplemented
        return self.__class__(self.secs + other.secs, self.nsecs + other.nsecs)

    __radd__ = __add__

    if TYPE_CHECKING:

        @overload
        def __sub__(self, other: Time) -> Duration: ...
        @overload
        def __sub__(self: TimeValue, other: Duration) -> TimeValue: ...
        def __sub__(self, other: Any) -> Any: ...

    else:

        def __sub__(self, other: Any) -> Any:
            if isinstance(other, Time):
                return Duration(self.secs - other.secs, self.nsecs - other.nsecs)
            if isinstance(other, Duration):
                return self.__class__(self.secs - other.secs, self.nsecs - other.nsecs)
            return NotImplemented


class Duration(TVal):
    """A span of time, which may be negative. For example, -0.1 s is secs -1 and nsecs 900000000."""

    __module__ = "genpy.rostime"

    __slots__: ClassVar[list[str]] = ["secs", "nsecs"]  # noqa: RUF023 # the order of the wire

    def __neg__(self: DurationValue) -> DurationValue:
        return self.__class__(-self.secs, -self.nsecs)

    def __abs__(self: DurationValue) -> DurationValue:
        return self.__class__(self.secs, self.nsecs) if self.secs >= 0 else -self

    def __add__(self: DurationValue, other: Duration) -> DurationValue:
        if not isinstance(other, Duration):
            return NotImplemented
        return self.__class__(self.secs + other.secs, self.nsecs + other.nsecs)

    __radd__ = __add__

    def __sub__(self: DurationValue, other: Duration) -> DurationValue:
        if not isinstance(other, Duration):
            return NotImplemented
        return self.__class__(self.secs - other.secs, self.nsecs - other.nsecs)

    def __mul__(self: DurationValue, factor: float) -> DurationValue:
        if not _is_real(factor):
            return NotImplemented
        if _is_integral(factor):
            return self.__class__(self.secs * factor, self.nsecs * factor)
        return self.__class__.from_sec(self.to_sec() * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Any:
        if isinstance(divisor, Duration):
            return self.to_sec() / divisor.to_sec()
        if not _is_real(divisor):
            return NotImplemented
        return self.__class__.from_sec(self.to_sec() / divisor)

    __div__ = __truediv__

    def __floordiv__(self, divisor: Any) -> Any:
        if isinstance(divisor, Duration):
            return int(self.to_sec() // divisor.to_sec())
        if not _is_real(divisor):
            return NotImplemented
        return self.__class__.from_sec(self.to_sec() // divisor)

    def __mod__(self: DurationValue, divisor: Duration) -> DurationValue:
        if not isinstance(divisor, Duration):
            return NotImplemented
        return self.__class__.from_sec(self.to_sec() % divisor.to_sec())

    def __divmod__(self: DurationValue, divisor: Duration) -> tuple[int, DurationValue]:
        if not isinstance(divisor, Duration):
            return NotImplemented
        quotient, rest = divmod(self.to_sec(), divisor.to_sec())
        return int(quotient), self.__class__.from_sec(rest)


Time._kind = Time
Duration._kind = Duration
