"""`set()`, `unset()`, `option()`, global properties, and `cmake_parse_arguments()`."""

from __future__ import annotations

from pipros.cmake.language import split_list
from pipros.cmake.scope import Scope


def set_variable(words: list[str], scope: Scope) -> None:
    """Carries out `set(name values… [CACHE type text [FORCE]] [PARENT_SCOPE])`."""
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
    """Carries out `unset(name [CACHE | PARENT_SCOPE])`."""
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
    """Carries out `option(name "text" [value])`: a variable that is set already keeps its value."""
    if not words:
        raise ValueError("called with incorrect number of arguments")
    if words[0] not in scope.values:
        scope.cache[words[0]] = words[2] if len(words) > 2 else "OFF"


def set_property(words: list[str], scope: Scope) -> None:
    """Carries out `set_property(GLOBAL … PROPERTY name values…)`; other properties are for compilers."""
    if words[:1] == ["GLOBAL"] and "PROPERTY" in words[:-1]:
        name, *values = words[words.index("PROPERTY") + 1 :]
        known = [scope.properties[name]] if name in scope.properties and "APPEND" in words else []
        scope.properties[name] = ";".join(known + values)


def get_property(words: list[str], scope: Scope) -> None:
    """Carries out `get_property(variable GLOBAL PROPERTY name)`; all other properties are empty."""
    if not words:
        raise ValueError("called with incorrect number of arguments")
    name = words[words.index("PROPERTY") + 1] if "PROPERTY" in words[:-1] else ""
    scope.values[words[0]] = scope.properties.get(name, "") if words[1:2] == ["GLOBAL"] else ""


def cmake_parse_arguments(words: list[str], scope: Scope) -> None:
    """Carries out `cmake_parse_arguments(prefix options one_value_keywords multi_value_keywords args…)`."""
    if words[:1] == ["PARSE_ARGV"]:
        _, first, prefix, options, single, multiple = words
        count = int(scope.values.get("ARGC", "0"))
        # Unlike in the other form, a word that is a list stays one.
        arguments = [scope.values[f"ARGV{n}"].replace(";", "\\;") for n in range(int(first), count)]
    elif len(words) >= 4:
        prefix, options, single, multiple, *arguments = words
    else:
        raise ValueError("must be called with at least 4 arguments")
    switches = split_list(options)
    one, many = split_list(single), split_list(multiple)
    found: dict[str, list[str]] = {}
    given: set[str] = set()
    unparsed: list[str] = []
    current = ""
    for word in arguments:
        if word and word in switches:
            given.add(word)
            current = ""
        elif word and word in (*one, *many):
            current = word
            found.setdefault(word, [])
        elif current:
            found[current].append(word)
            current = current if current in many else ""
        else:
            unparsed.append(word)
    for name in filter(None, switches):
        scope.values[f"{prefix}_{name}"] = "TRUE" if name in given else "FALSE"
    missing = [name for name, values in found.items() if not values]
    results = {name: found.get(name, []) for name in filter(None, (*one, *many))}
    results |= {"UNPARSED_ARGUMENTS": unparsed, "KEYWORDS_MISSING_VALUES": missing}
    for name, values in results.items():
        if values:
            scope.values[f"{prefix}_{name}"] = ";".join(values)
        else:
            scope.unset(f"{prefix}_{name}")
