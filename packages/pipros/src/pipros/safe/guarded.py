"""The operations and functions of safe expressions, with bounds on the size of their results."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, ItemsView, Iterable, KeysView, Mapping, ValuesView
from typing import Any

from pipros.basics.errors import PiprosError

EXPRESSION_SIZE = 100_000
"""Limit: characters of a string, or elements of a nested list, that an expression builds. Beyond it, the
expression is refused.
"""
EXPRESSION_WORK = 2_000_000
"""Limit: the sizes of all values that an expression builds, plus a charge for steps that take longer than
their results' sizes suggest. Beyond it, the expression is refused.
"""

BITS_LIMIT = 4096
"""Maximum number of bits in an integer, far more than the 32 bits of an integer parameter."""

_COUNT_LIMIT = 1000
_WIDTH = re.compile(r"\d+")
_WIDTH_LIMIT = 1000


class ResultTooLarge(PiprosError, ValueError):
    """A result would be larger than its limit, or the budget is used up."""


class WorkBudget:
    """The remaining work budget of one evaluation, which limits the total size of its results."""

    def __init__(self) -> None:
        self._size_limit = EXPRESSION_SIZE
        self._left = EXPRESSION_WORK
        self.functions: Mapping[str, Callable[..., Any]] = {
            "dict": self._dict,
            "pow": self.power,
            "prod": self._product,
            "range": self._range,
            "set": self._set,
            "sum": self._total,
        }
        """Functions whose work is charged while they run."""

    def charge(self, value: object) -> Any:
        """Charge the size of a value and return the value.

        Raises:
            ResultTooLarge: the value exceeds `EXPRESSION_SIZE`, or the budget is used up.
        """
        self.spend(self._bounded(self._size_of(value)))
        return value

    def foresee(self, size: int) -> None:
        """Check the size of a result before computing it.

        Raises:
            ResultTooLarge: the size exceeds `EXPRESSION_SIZE`.
        """
        self._bounded(size)

    def spend(self, work: int) -> None:
        """Use up `work` units of the budget. Raises ResultTooLarge if fewer are left."""
        self._left -= work
        if self._left < 0:
            raise ResultTooLarge("the expression does too much work")

    def spend_on_reading(self, *values: object) -> None:
        """Charge the size of each of `values`, for an operation that reads all their parts.

        Raises the same errors as `spend`.
        """
        for value in values:
            self.spend(self._size_of(value))

    def add(self, left: Any, right: Any) -> Any:
        if hasattr(left, "__len__") and hasattr(right, "__len__"):
            self._bounded(len(left) + len(right))
        return left + right

    def multiply(self, left: Any, right: Any) -> Any:
        for sequence, count in ((left, right), (right, left)):
            if hasattr(sequence, "__len__") and isinstance(count, int):
                self._bounded(self._size_of(sequence) * count)
        if isinstance(left, int) and isinstance(right, int):
            _check_bits(left.bit_length() + right.bit_length())
        return left * right

    def power(self, base: Any, exponent: Any, modulus: Any = None) -> Any:
        if isinstance(base, int) and isinstance(exponent, int):
            _check_bits(base.bit_length() * abs(exponent))
        return pow(base, exponent, modulus)

    def shift_left(self, value: Any, count: Any) -> Any:
        if isinstance(value, int) and isinstance(count, int):
            _check_bits(value.bit_length() + count)
        return value << count

    def modulo(self, left: Any, right: Any) -> Any:
        """Return the remainder, or a formatted string with bounded widths."""
        if isinstance(left, (str, bytes)):
            form = left if isinstance(left, str) else left.decode("latin-1")
            if "*" in form:
                raise ResultTooLarge("a width must be written as a number, not as *")
            _check_width(form)
            self._bounded(form.count("%") * self._size_of(right))
        return left % right

    def _bounded(self, size: int) -> int:
        if size > self._size_limit:
            raise ResultTooLarge(
                f"a result of more than {self._size_limit} characters or elements is not allowed"
            )
        return size

    def _size_of(self, value: object) -> int:
        """Return the size of a value, including its nested elements; counting stops above the limit.

        A long string that occurs a thousand times in a list counts a thousand times, as in `str` of the list.
        """
        if isinstance(value, (str, bytes, range)):
            return len(value)
        if isinstance(value, (list, tuple, set, dict, KeysView, ValuesView, ItemsView)):
            size = len(value)
            parts = (part for pair in value.items() for part in pair) if isinstance(value, dict) else value
            for part in parts:
                if size > self._size_limit:
                    break
                size += self._size_of(part)
            return size
        return 1

    def _range(self, *bounds: int) -> range:
        numbers = range(*bounds)
        self._bounded(len(numbers))
        return numbers

    def _set(self, values: Iterable[object] = (), /) -> set[Any]:
        members = list(values)
        self.spend_on_hashes(members)
        return set(members)

    def _dict(self, values: Any = (), /, **named: Any) -> dict[Any, Any]:
        if not isinstance(values, dict):
            values = [tuple(pair) for pair in values]
            self.spend_on_hashes([pair[0] for pair in values if pair])
        return dict(values, **named)

    def spend_on_hashes(self, keys: Iterable[object]) -> None:
        """Charge for comparing keys with equal hashes, because numbers can be chosen so that they collide."""
        first: dict[int, Any] = {}
        collisions: dict[int, int] = {}
        for key in keys:
            key_hash = hash(key)
            other = first.setdefault(key_hash, key)
            if other is not key and other != key:
                collisions[key_hash] = collisions.get(key_hash, 0) + 1
                self.spend(collisions[key_hash])

    def _product(self, factors: Iterable[object], *, start: object = 1) -> Any:
        return self._folded(self.multiply, factors, start)

    def _total(self, values: Iterable[object], start: object = 0) -> Any:
        return self._folded(self.add, values, start)

    def _folded(self, operation: Callable[[Any, Any], Any], values: Iterable[object], start: object) -> Any:
        """Combine `start` with each of `values` in order. Charge the length of each intermediate result."""
        result = start
        for value in values:
            result = operation(result, value)
            self.spend(len(result) if hasattr(result, "__len__") else 1)
        return result


def format_value(value: object, form: str) -> str:
    """Return `value` formatted as in an f-string, with a bounded width."""
    _check_width(form)
    return format(value, form)


def _check_bits(bits: float) -> None:
    if bits > BITS_LIMIT:
        raise ResultTooLarge(f"the number would have more than {BITS_LIMIT} bits")


def _check_width(form: str) -> None:
    widths = (int(digits[:9]) for digits in _WIDTH.findall(form))
    if any(width > _WIDTH_LIMIT for width in widths):
        raise ResultTooLarge(f"a width above {_WIDTH_LIMIT} is not allowed")


def _bounded_count(function: Callable[..., Any]) -> Callable[..., Any]:
    """Bound the arguments of functions whose running time grows with them, such as `factorial`."""

    def guarded(*counts: int) -> Any:
        if any(abs(count) > _COUNT_LIMIT for count in counts):
            raise ResultTooLarge(f"arguments above {_COUNT_LIMIT} are not allowed")
        return function(*counts)

    return guarded


def _round(number: Any, digits: int | None = None) -> Any:
    if digits is not None and abs(digits) > _COUNT_LIMIT:
        raise ResultTooLarge(f"more than {_COUNT_LIMIT} digits are not allowed")
    return round(number, digits)


def _guarded_math() -> dict[str, Any]:
    """Return the public names of `math`, with bounds on the arguments of expensive functions."""
    names = {name: value for name, value in vars(math).items() if not name.startswith("_")}
    names.update({name: _bounded_count(names[name]) for name in ("factorial", "comb", "perm")})
    names.update(lcm=_bounded_count(math.lcm))
    del names["prod"], names["pow"]  # `WorkBudget` provides these functions
    return names


_MATH = _guarded_math()

CONSTANTS: Mapping[str, Any] = {
    **{name: value for name, value in _MATH.items() if not callable(value)},
    "true": True,
    "false": False,
}

FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{name: value for name, value in _MATH.items() if callable(value)},
    "abs": abs, "all": all, "any": any, "bin": bin, "bool": bool, "chr": chr, "divmod": divmod,
    "enumerate": lambda *values, **start: list(enumerate(*values, **start)),
    "filter": lambda function, values: list(filter(function, values)),
    "float": float, "hex": hex, "int": int, "len": len, "list": list,
    "map": lambda function, *values: list(map(function, *values)),
    "max": max, "min": min, "oct": oct, "ord": ord, "repr": repr,
    "reversed": lambda values: list(reversed(values)),
    "round": _round, "sorted": sorted, "str": str, "tuple": tuple,
    "zip": lambda *parts: list(zip(*parts, strict=False)),
}  # fmt: skip
