"""The operations and functions of safe expressions that could grow without bound, with their bounds."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pipros.errors import PiprosError

SIZE_LIMIT = 100_000
"""Characters of a text, and elements of a list with all that is in them, that an expression may build."""

WORK_LIMIT = 2_000_000
"""The sum of the sizes of all that one evaluation builds."""

BITS_LIMIT = 4096
"""Bits of a whole number; a parameter holds 32."""

_COUNT_LIMIT = 1000
_WIDTH = re.compile(r"\d+")
_WIDTH_LIMIT = 1000


class TooLarge(PiprosError, ValueError):
    """A result would be larger than any sensible expression's."""


class Budget:
    """What one evaluation may still build. Many results of legal size are too much together."""

    def __init__(self) -> None:
        self._left = WORK_LIMIT

    def charge(self, value: Any) -> Any:
        """Gives the value back when it can be afforded.

        Raises:
            TooLarge: for a value beyond SIZE_LIMIT, or when the budget is used up.
        """
        self._left -= _bounded(size_of(value))
        if self._left < 0:
            raise TooLarge("the expression builds too much")
        return value


def size_of(value: Any) -> int:
    """How much a value would be if it were written down; counting ends beyond SIZE_LIMIT.

    A list that holds one long text a thousand times counts it a thousand times, although in memory
    it is one: `str` of that list would not be.
    """
    if isinstance(value, (str, bytes, range)):
        return len(value)
    if isinstance(value, (list, tuple, set, dict)):
        size = len(value)
        parts = (part for pair in value.items() for part in pair) if isinstance(value, dict) else value
        for part in parts:
            if size > SIZE_LIMIT:
                break
            size += size_of(part)
        return size
    return 1


def _bounded(size: int) -> int:
    if size > SIZE_LIMIT:
        raise TooLarge(f"a result of more than {SIZE_LIMIT} characters or elements is not allowed")
    return size


def _bounded_bits(bits: float) -> None:
    if bits > BITS_LIMIT:
        raise TooLarge(f"the number would have more than {BITS_LIMIT} bits")


def add(left: Any, right: Any) -> Any:
    if hasattr(left, "__len__") and hasattr(right, "__len__"):
        _bounded(len(left) + len(right))
    return left + right


def multiply(left: Any, right: Any) -> Any:
    for sequence, count in ((left, right), (right, left)):
        if hasattr(sequence, "__len__") and isinstance(count, int):
            _bounded(size_of(sequence) * count)
    if isinstance(left, int) and isinstance(right, int):
        _bounded_bits(left.bit_length() + right.bit_length())
    return left * right


def power(base: Any, exponent: Any, modulus: Any = None) -> Any:
    if isinstance(base, int) and isinstance(exponent, int):
        _bounded_bits(base.bit_length() * abs(exponent))
    return pow(base, exponent, modulus)


def shift_left(value: Any, count: Any) -> Any:
    if isinstance(value, int) and isinstance(count, int):
        _bounded_bits(value.bit_length() + count)
    return value << count


def modulo(left: Any, right: Any) -> Any:
    """The remainder; or a text with its `%` forms filled in, whose widths are bounded."""
    if isinstance(left, (str, bytes)):
        form = left if isinstance(left, str) else left.decode("latin-1")
        if "*" in form:
            raise TooLarge("a width given by * is not allowed")
        _bounded_width(form)
        _bounded(form.count("%") * size_of(right))
    return left % right


def format_value(value: Any, form: str) -> str:
    """`value` in the format of an f-string."""
    _bounded_width(form)
    return format(value, form)


def _bounded_width(form: str) -> None:
    widths = (int(digits[:9]) for digits in _WIDTH.findall(form))
    if any(width > _WIDTH_LIMIT for width in widths):
        raise TooLarge(f"a width above {_WIDTH_LIMIT} is not allowed")


def _bounded_range(*bounds: int) -> range:
    numbers = range(*bounds)
    _bounded(len(numbers))
    return numbers


def _bounded_count(function: Callable[..., Any]) -> Callable[..., Any]:
    """Guards functions whose time grows with the value of their arguments, such as `factorial`."""

    def guarded(*counts: int) -> Any:
        if any(abs(count) > _COUNT_LIMIT for count in counts):
            raise TooLarge(f"arguments above {_COUNT_LIMIT} are not allowed")
        return function(*counts)

    return guarded


def _round(number: Any, digits: int | None = None) -> Any:
    if digits is not None and abs(digits) > _COUNT_LIMIT:
        raise TooLarge(f"more than {_COUNT_LIMIT} digits are not allowed")
    return round(number, digits)


def _product(factors: Iterable[Any], *, start: Any = 1) -> Any:
    result = start
    for factor in factors:
        result = multiply(result, factor)
    return result


def _total(values: Iterable[Any], start: Any = 0) -> Any:
    result = start
    for value in values:
        result = add(result, value)
    return result


def _guarded_math() -> dict[str, Any]:
    """All public names of `math`, those that could run away replaced."""
    names = {name: value for name, value in vars(math).items() if not name.startswith("_")}
    names.update({name: _bounded_count(names[name]) for name in ("factorial", "comb", "perm")})
    names.update(prod=_product, lcm=_bounded_count(math.lcm))
    return names


_MATH = _guarded_math()

CONSTANTS: Mapping[str, Any] = {
    **{name: value for name, value in _MATH.items() if not callable(value)},
    "true": True,
    "false": False,
}

FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{name: value for name, value in _MATH.items() if callable(value)},
    "abs": abs, "all": all, "any": any, "bin": bin, "bool": bool, "chr": chr, "dict": dict, "divmod": divmod,
    "float": float, "hex": hex, "int": int, "len": len, "list": list, "max": max, "min": min, "oct": oct,
    "ord": ord, "pow": power, "range": _bounded_range, "round": _round, "set": set, "sorted": sorted,
    "str": str, "sum": _total, "tuple": tuple, "zip": lambda *parts: list(zip(*parts, strict=False)),
}  # fmt: skip
