"""The methods that a safe expression may call. They have no side effects and are listed in fixed tables.

A method is looked up by the exact class of its value, never by `getattr` with a name from the expression.
Methods whose results may be much larger than their arguments check the budget before they run.
"""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

from pipros.safe.guarded import WorkBudget, format_value

Method = Callable[..., Any]


def find_method(value: object, name: str) -> Method | None:
    """Return the function for `value.name(…)`, or None if the method is not allowed.

    The function's first arguments are the budget and the value.

    >>> find_method("a b", "split")(WorkBudget(), "a b")
    ['a', 'b']
    >>> find_method([], "append") is None
    True
    """
    return METHODS.get(type(value), {}).get(name)


def _plain(kind: type, *names: str) -> dict[str, Method]:
    """Return the named methods. They need no budget: their results are about as large as their arguments."""

    def call(method: Method) -> Method:
        return lambda _, *arguments, **keywords: method(*arguments, **keywords)

    return {name: call(getattr(kind, name)) for name in names}


def _cut(method: Method) -> Method:
    """Wrap a method that splits a string. In the worst case, each character becomes a part."""

    def call(budget: WorkBudget, text: str, *arguments: object, **keywords: object) -> Any:
        budget.foresee(len(text))
        return method(text, *arguments, **keywords)

    return call


def _replace(budget: WorkBudget, text: str, old: str, new: str, count: int = -1) -> str:
    times = text.count(old) if count < 0 else min(count, text.count(old))
    budget.foresee(len(text) + times * (len(new) - len(old)))
    return text.replace(old, new, count)


def _join(budget: WorkBudget, separator: str, parts: Iterable[str]) -> str:
    listed = list(parts)
    budget.foresee(sum(len(part) for part in listed) + len(separator) * len(listed))
    return separator.join(listed)


def _padded(method: Method) -> Method:
    def call(budget: WorkBudget, text: str, width: int, *fill: str) -> Any:
        budget.foresee(width)
        return method(text, width, *fill)

    return call


def _combining(method: Method) -> Method:
    """Wrap a method that looks up the members of some sets in others."""

    def call(budget: WorkBudget, members: set[Any], *others: Iterable[object]) -> Any:
        budget.spend_on_hashes(chain(members, *others))
        return method(members, *others)

    return call


def _expand_tabs(budget: WorkBudget, text: str, tabsize: int = 8) -> str:
    budget.foresee(len(text) + text.count("\t") * max(tabsize, 0))
    return text.expandtabs(tabsize)


class _Format(string.Formatter):
    """`str.format` without attributes: `{}`, `{0}`, `{name}`, `{0[key]}` and formats of bounded width."""

    def __init__(self, budget: WorkBudget) -> None:
        self._budget = budget

    def get_field(self, field_name: str, args: Sequence[object], kwargs: Mapping[str, object]) -> Any:
        if "." in field_name.partition("[")[0] or "]." in field_name:
            raise ValueError(f"attributes, as in {{{field_name}}}, are not allowed here")
        return super().get_field(field_name, args, kwargs)

    def format_field(self, value: object, format_spec: str) -> str:
        text = format_value(value, format_spec)
        self._budget.charge(text)
        return text


def _format(budget: WorkBudget, text: str, *arguments: object, **keywords: object) -> str:
    return _Format(budget).vformat(text, arguments, keywords)


_TEXT: Mapping[str, Method] = {
    **_plain(
        str, "capitalize", "casefold", "count", "endswith", "find", "index", "isalnum", "isalpha", "isascii",
        "isdecimal", "isdigit", "isidentifier", "islower", "isnumeric", "isprintable", "isspace", "istitle",
        "isupper", "lower", "lstrip", "partition", "removeprefix", "removesuffix", "rfind", "rindex",
        "rpartition", "rstrip", "startswith", "strip", "swapcase", "title", "upper",
    ),
    **{method.__name__: _cut(method) for method in (str.split, str.rsplit, str.splitlines)},
    **{method.__name__: _padded(method) for method in (str.center, str.ljust, str.rjust, str.zfill)},
    "expandtabs": _expand_tabs,
    "format": _format,
    "join": _join,
    "replace": _replace,
}  # fmt: skip
_SET = {
    name: _combining(getattr(set, name))
    for name in (
        "difference", "intersection", "isdisjoint", "issubset", "issuperset", "symmetric_difference", "union",
    )
}  # fmt: skip

METHODS: Mapping[type, Mapping[str, Method]] = {
    str: _TEXT,
    bytes: _plain(bytes, "count", "endswith", "find", "hex", "index", "startswith", "strip"),
    list: _plain(list, "copy", "count", "index"),
    tuple: _plain(tuple, "count", "index"),
    dict: _plain(dict, "copy", "get", "items", "keys", "values"),
    set: _SET,
    int: _plain(int, "bit_length"),
    float: _plain(float, "is_integer"),
}
