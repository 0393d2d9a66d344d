"""The commands `set()`, `unset()`, `option()` and `cmake_parse_arguments()`, and commands for properties."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pipros_workspace.cmake.language import split_list
from pipros_workspace.cmake.scope import Scope


def set_variable(words: list[str], scope: Scope) -> None:
    """Execute `set(name values… [CACHE type text [FORCE]] [PARENT_SCOPE])`."""
    if not words:
        raise ValueError("called with incorrect number of arguments")
    name, *values = words
    if name.startswith("ENV{"):
        scope.environment[name[4:-1]] = values[0] if values else ""
    elif values[-1:] == ["PARENT_SCOPE"]:
        scope.set_in_parent(name, ";".join(values[:-1]) if values[:-1] else None)
    elif "CACHE" in values:
        place = values.index("CACHE")
        if name not in scope.cache or values[-1] == "FORCE":
            scope.cache[name] = ";".join(values[:place])
    elif values:
        scope.values[name] = ";".join(values)
    else:
        scope.unset(name)


def unset(words: list[str], scope: Scope) -> None:
    """Execute `unset(name [CACHE | PARENT_SCOPE])`."""
    if not words:
        raise ValueError("called with incorrect number of arguments")
    if words[0].startswith("ENV{"):
        scope.environment.pop(words[0][4:-1], None)
    elif words[1:] == ["PARENT_SCOPE"]:
        scope.set_in_parent(words[0], None)
    elif words[1:] == ["CACHE"]:
        scope.cache.pop(words[0], None)
    else:
        scope.unset(words[0])


def option(words: list[str], scope: Scope) -> None:
    """Execute `option(name "text" [value])`. A variable that is already set keeps its value."""
    if not words:
        raise ValueError("called with incorrect number of arguments")
    if words[0] not in scope.values:
        scope.cache[words[0]] = words[2] if len(words) > 2 else "OFF"


def set_property(words: list[str], scope: Scope) -> None:
    """Execute `set_property(GLOBAL … PROPERTY name values…)`.

    Properties of other objects, such as targets and source files, matter only to compilers and are ignored.
    """
    if "PROPERTY" not in words[:-1]:
        raise ValueError("called with incorrect number of arguments")
    if words[0] == "GLOBAL":
        place = words.index("PROPERTY")
        name, *values = words[place + 1 :]
        known = scope.properties.get(name, "")
        text = ";".join(values)
        if "APPEND_STRING" in words[:place]:
            text = known + text
        elif "APPEND" in words[:place] and known:
            text = f"{known};{text}"
        scope.properties[name] = text


def get_property(words: list[str], scope: Scope) -> None:
    """Execute `get_property(variable GLOBAL PROPERTY name)`. All other properties are empty."""
    if len(words) < 3:
        raise ValueError("called with incorrect number of arguments")
    name = words[words.index("PROPERTY") + 1] if "PROPERTY" in words[:-1] else ""
    value = scope.properties.get(name) if words[1] == "GLOBAL" else None
    if words[-1] == "SET":
        value = "0" if value is None else "1"
    elif words[-1] in ("DEFINED", "BRIEF_DOCS", "FULL_DOCS"):
        value = "0" if words[-1] == "DEFINED" else "NOTFOUND"
    scope.values[words[0]] = value or ""


def cmake_parse_arguments(words: list[str], scope: Scope) -> None:
    """Execute `cmake_parse_arguments(prefix options one_value_keywords multi_value_keywords args…)`."""
    keeps_lists = words[:1] == ["PARSE_ARGV"]  # only then does a word that is a list remain one element
    if keeps_lists:
        _, first, prefix, options, single, multiple = words
        count = int(scope.values.get("ARGC", "0"))
        arguments = [scope.values[f"ARGV{n}"] for n in range(int(first), count)]
    elif len(words) >= 4:
        prefix, options, single, multiple, *arguments = words
    else:
        raise ValueError("must be called with at least 4 arguments")
    switches, one, many = split_list(options), split_list(single), split_list(multiple)
    element = _element if keeps_lists else str
    given, values_of = _values_of_keywords(arguments, switches, one, many, element)
    for name in filter(None, switches):
        scope.values[f"{prefix}_{name}"] = "TRUE" if name in given else "FALSE"
    for name in (*filter(None, (*one, *many)), "UNPARSED_ARGUMENTS", "KEYWORDS_MISSING_VALUES"):
        if values := values_of.get(name):
            scope.values[f"{prefix}_{name}"] = ";".join(values)
        else:
            scope.unset(f"{prefix}_{name}")


def _values_of_keywords(
    arguments: Sequence[str],
    switches: Sequence[str],
    one: Sequence[str],
    many: Sequence[str],
    element: Callable[[str], str],
) -> tuple[set[str], dict[str, list[str]]]:
    """Return the keywords that occur, and the values of each, of those without values, and of no keyword."""
    values: dict[str, list[str]] = {}
    given: set[str] = set()
    missing: set[str] = set()
    unparsed: list[str] = []
    keyword = ""
    for word in arguments:
        if word and word in (*switches, *one, *many):
            if keyword and not values.get(keyword):
                missing.add(keyword)
            given.add(word)
            keyword = "" if word in switches else word
        elif not keyword:
            unparsed.append(element(word))
        elif keyword in many:
            values.setdefault(keyword, []).append(element(word))
        else:
            values[keyword] = [word]
            keyword = ""
    if keyword and (keyword in one or not values.get(keyword)):
        missing.add(keyword)
    return given, values | {"UNPARSED_ARGUMENTS": unparsed, "KEYWORDS_MISSING_VALUES": sorted(missing)}


def _element(word: str) -> str:
    """Escape a word so that it remains one element of a list."""
    return word.replace(";", "\\;")
