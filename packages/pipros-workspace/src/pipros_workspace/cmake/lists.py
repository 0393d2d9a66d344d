"""The command `list()`, which operates on lists.

A list is a string whose elements are separated by semicolons.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from pipros_workspace.cmake import regex
from pipros_workspace.cmake.language import split_list
from pipros_workspace.cmake.scope import Scope, Unsupported, check_length


def carry_out(words: list[str], scope: Scope) -> None:
    """Execute `list(words)`.

    Raises:
        ValueError: the arguments are wrong.
        Unsupported: only CMake itself supports the subcommand.
    """
    if len(words) < 2:
        raise ValueError("must be called with at least two arguments")
    operation, name, *rest = words
    action = _OPERATIONS.get(operation)
    if action is None:
        raise Unsupported(f"list({operation})")
    text = scope.values.get(name, "")
    if operation == "GET" and not text and name in scope.values:
        raise ValueError("GET given empty list")
    changed = action(split_list(text) if text else [], rest, scope)
    if changed is not None:
        scope.values[name] = ";".join(changed)


Elements = list[str]
_Operation = Callable[[Elements, list[str], Scope], Elements | None]
"""A subcommand.

It is called with the elements and the remaining words, and returns the new elements if they change.
"""


def _length(elements: Elements, rest: list[str], scope: Scope) -> None:
    scope.values[_first(rest)] = str(len(elements))


def _get(elements: Elements, rest: list[str], scope: Scope) -> None:
    *places, output = rest or [""]
    found = [elements[_place(place, len(elements))] for place in places] if elements else ["NOTFOUND"]
    scope.values[output] = ";".join(found)


def _join(elements: Elements, rest: list[str], scope: Scope) -> None:
    glue, output = _of(2, rest)
    check_length(len(glue) * len(elements))
    scope.values[output] = glue.join(elements)


def _sublist(elements: Elements, rest: list[str], scope: Scope) -> None:
    begin, length, output = _of(3, rest)
    first = _number(begin)
    if elements and not 0 <= first < len(elements):
        raise ValueError(f"begin index: {first} is out of range 0 - {len(elements) - 1}")
    last = None if _number(length) < 0 else first + _number(length)
    scope.values[output] = ";".join(elements[first:last])


def _find(elements: Elements, rest: list[str], scope: Scope) -> None:
    wanted, output = _of(2, rest)
    scope.values[output] = str(elements.index(wanted) if wanted in elements else -1)


def _insert(elements: Elements, rest: list[str], _scope: Scope) -> Elements:
    place = _number(_first(rest))
    if not elements and place not in (0, -1):
        raise ValueError(f"index: {place} out of range (0, 0)")
    place = _place(str(place), len(elements) + (place >= 0)) if elements else 0
    return elements[:place] + rest[1:] + elements[place:]


def _pop(elements: Elements, rest: list[str], scope: Scope, place: int) -> Elements:
    for output in rest:
        if elements:
            scope.values[output] = elements.pop(place)
        else:
            scope.unset(output)
    if elements and not rest:
        elements.pop(place)
    return elements


def _remove_at(elements: Elements, rest: list[str], _scope: Scope) -> Elements:
    places = {_place(word, len(elements)) for word in rest}
    return [element for place, element in enumerate(elements) if place not in places]


def _filter(elements: Elements, rest: list[str], _scope: Scope) -> Elements:
    mode, kind, expression = _of(3, rest)
    if mode not in ("INCLUDE", "EXCLUDE") or kind != "REGEX":
        raise ValueError("FILTER needs INCLUDE or EXCLUDE, and REGEX with an expression")
    pattern = regex.compiled(expression)
    return [element for element in elements if (pattern.search(element) is not None) is (mode == "INCLUDE")]


_SORT_OPTIONS = {
    "COMPARE": ("STRING", "FILE_BASENAME", "NATURAL"),
    "CASE": ("SENSITIVE", "INSENSITIVE"),
    "ORDER": ("ASCENDING", "DESCENDING"),
}


def _sort(elements: Elements, rest: list[str], _scope: Scope) -> Elements:
    options = dict(zip(rest[::2], rest[1::2], strict=False))
    for option, value in options.items():
        if value not in _SORT_OPTIONS.get(option, ()):
            raise ValueError(f'sub-command SORT value "{value}" for option "{option}" is invalid')

    def key(element: str) -> tuple[object, ...]:
        if options.get("COMPARE") == "FILE_BASENAME":
            element = element.rpartition("/")[2]
        if options.get("CASE") == "INSENSITIVE":
            element = element.lower()
        if options.get("COMPARE") == "NATURAL":
            return tuple(
                (int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", element)
            )
        return (element,)

    return sorted(elements, key=key, reverse=options.get("ORDER") == "DESCENDING")


def _transform(elements: Elements, rest: list[str], scope: Scope) -> Elements | None:
    action, *rest = rest or [""]
    count = {"APPEND": 1, "PREPEND": 1, "REPLACE": 2}.get(action, 0)
    arguments, rest = rest[:count], rest[count:]
    output = None
    if rest[-2:-1] == ["OUTPUT_VARIABLE"]:
        output, rest = rest[-1], rest[:-2]
    is_chosen = _selector(rest, len(elements))
    changes: Mapping[str, Callable[[str], str]] = {
        "APPEND": lambda element: element + arguments[0],
        "PREPEND": lambda element: arguments[0] + element,
        "TOUPPER": str.upper,
        "TOLOWER": str.lower,
        "STRIP": str.strip,
        "REPLACE": lambda element: regex.replace(arguments[0], arguments[1], element),
    }
    if action not in changes or len(arguments) < count:
        raise Unsupported(f"list(TRANSFORM … {action})")
    check_length(len(elements) * max(map(len, arguments), default=0))
    changed = [
        changes[action](element) if is_chosen(place, element) else element
        for place, element in enumerate(elements)
    ]
    if output is None:
        return changed
    scope.values[output] = ";".join(changed)
    return None


def _selector(words: list[str], count: int) -> Callable[[int, str], bool]:
    if not words:
        return lambda _place, _element: True
    kind, *rest = words
    if kind == "AT":
        places = {_place(word, count) for word in rest}
        return lambda place, _element: place in places
    if kind == "FOR":
        first, last, step = (*map(_number, rest), 1)[:3]
        chosen = range(first, last + 1, step)
        return lambda place, _element: place in chosen
    if kind == "REGEX":
        pattern = regex.compiled(_first(rest))
        return lambda _place, element: pattern.search(element) is not None
    raise ValueError(f"TRANSFORM has no selector [{kind}]")


def _first(words: list[str]) -> str:
    return _of(1, words)[0]


def _of(count: int, words: list[str]) -> list[str]:
    if len(words) < count:
        raise ValueError("has too few arguments")
    return words[:count]


def _number(word: str) -> int:
    try:
        return int(word)
    except ValueError:
        raise ValueError(f"index: {word} is not a valid index") from None


def _place(word: str, count: int) -> int:
    """Convert a word to an index into a list; negative indices count from the end."""
    place = _number(word)
    if not -count <= place < count:
        raise ValueError(f"index: {place} out of range ({-count}, {count - 1})")
    return place % count


_OPERATIONS: Mapping[str, _Operation] = {
    "LENGTH": _length,
    "GET": _get,
    "JOIN": _join,
    "SUBLIST": _sublist,
    "FIND": _find,
    "APPEND": lambda elements, rest, _scope: elements + rest,
    "PREPEND": lambda elements, rest, _scope: rest + elements,
    "INSERT": _insert,
    "POP_BACK": lambda elements, rest, scope: _pop(elements, rest, scope, -1),
    "POP_FRONT": lambda elements, rest, scope: _pop(elements, rest, scope, 0),
    "REMOVE_ITEM": lambda elements, rest, _scope: [each for each in elements if each not in rest],
    "REMOVE_AT": _remove_at,
    "REMOVE_DUPLICATES": lambda elements, _rest, _scope: list(dict.fromkeys(elements)),
    "REVERSE": lambda elements, _rest, _scope: elements[::-1],
    "FILTER": _filter,
    "SORT": _sort,
    "TRANSFORM": _transform,
}
