"""The commands `string()` and `separate_arguments()`."""

from __future__ import annotations

import hashlib
import operator
import random
import re
import time
import uuid
from collections.abc import Callable, Mapping

from pipros.basics.windows import ON_WINDOWS
from pipros.basics.words import split_words
from pipros_workspace.cmake import regex
from pipros_workspace.cmake.configure import configured
from pipros_workspace.cmake.files import HASHES
from pipros_workspace.cmake.scope import Scope, Unsupported, check_length
from pipros_workspace.cmake.words import options_of


def carry_out(words: list[str], scope: Scope) -> None:
    """Execute `string(words)`.

    Raises:
        ValueError: the arguments are wrong.
        Unsupported: only CMake itself supports the subcommand.
    """
    operation, *rest = words or [""]
    action = _OPERATIONS.get(operation)
    try:
        if action is not None:
            action(rest, scope)
        elif operation in HASHES:
            output, text = rest
            digest = hashlib.new(operation.lower(), text.encode(), usedforsecurity=False)
            scope.values[output] = digest.hexdigest()
        else:
            raise Unsupported(f"string({operation})")
    except IndexError:
        raise ValueError(f"sub-command {operation} has too few arguments") from None


def _find(words: list[str], scope: Scope) -> None:
    text, wanted, output = words[0], words[1], words[2]
    scope.values[output] = str((str.rfind if words[3:] == ["REVERSE"] else str.find)(text, wanted))


def _replace(words: list[str], scope: Scope) -> None:
    text, old, new = "".join(words[3:]), words[0], words[1]
    check_length(len(text) + text.count(old) * (len(new) - len(old)))
    scope.values[words[2]] = text.replace(old, new)


def _regex(words: list[str], scope: Scope) -> None:
    kind, expression = words[0], words[1]
    if kind == "REPLACE":
        scope.values[words[3]] = regex.replace(expression, words[2], "".join(words[4:]))
        return
    output, text = words[2], "".join(words[3:])
    matches = regex.compiled(expression).matches(text)
    if kind == "MATCH":
        matches = matches[:1]
    elif kind != "MATCHALL":
        raise ValueError(f"sub-command REGEX does not recognize mode {kind}")
    for match in matches:
        regex.require_text(match, kind)
        regex.keep_groups(match, scope.values)
    scope.values[output] = ";".join(match[0] for match in matches)


def _append(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = scope.values.get(words[0], "") + "".join(words[1:])


def _prepend(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = "".join(words[1:]) + scope.values.get(words[0], "")


def _concat(words: list[str], scope: Scope) -> None:
    scope.values[words[0]] = "".join(words[1:])


def _join(words: list[str], scope: Scope) -> None:
    check_length(len(words[0]) * len(words[2:]))
    scope.values[words[1]] = words[0].join(words[2:])


def _change(change: Callable[[str], str]) -> Callable[[list[str], Scope], None]:
    def carry_out(words: list[str], scope: Scope) -> None:
        scope.values[words[1]] = change(words[0])

    return carry_out


def _substring(words: list[str], scope: Scope) -> None:
    text, begin, length = words[0], int(words[1]), int(words[2])
    if length < -1:
        raise ValueError(f"end index: {length} should be -1 or greater")
    if not 0 <= begin <= len(text):
        raise ValueError(f"sub-command SUBSTRING: begin index: {begin} is out of range 0 - {len(text)}")
    scope.values[words[3]] = text[begin:] if length < 0 else text[begin : begin + length]


def _repeat(words: list[str], scope: Scope) -> None:
    text, count = words[0], int(words[1])
    if count < 0:
        raise ValueError("repeat count is not a positive number")
    check_length(len(text) * count)
    scope.values[words[2]] = text * count


def _compare(words: list[str], scope: Scope) -> None:
    compare: dict[str, Callable[[str, str], bool]] = {
        "LESS": operator.lt,
        "GREATER": operator.gt,
        "EQUAL": operator.eq,
        "NOTEQUAL": operator.ne,
        "LESS_EQUAL": operator.le,
        "GREATER_EQUAL": operator.ge,
    }
    if words[0] not in compare:
        raise ValueError(f"sub-command COMPARE does not recognize mode {words[0]}")
    scope.values[words[3]] = "1" if compare[words[0]](words[1], words[2]) else "0"


def _ascii(words: list[str], scope: Scope) -> None:
    codes = [int(word) for word in words[:-1]]
    for code in codes:
        if not 0 < code < 256:
            raise ValueError(f"Character with code {code} does not exist.")
    scope.values[words[-1]] = "".join(map(chr, codes))


def _configure(words: list[str], scope: Scope) -> None:
    options = words[2:]
    scope.values[words[1]] = configured(words[0], scope, at_only="@ONLY" in options,
                                        escapes_quotes="ESCAPE_QUOTES" in options)  # fmt: skip


def _timestamp(words: list[str], scope: Scope) -> None:
    rest = [word for word in words[1:] if word != "UTC"]
    now = time.gmtime() if "UTC" in words else time.localtime()
    scope.values[words[0]] = time.strftime(rest[0] if rest else "%Y-%m-%dT%H:%M:%S", now)


def _uuid(words: list[str], scope: Scope) -> None:
    options = options_of(words, "NAMESPACE", "NAME", "TYPE")
    if len(options) < 3 or options["TYPE"] not in ("MD5", "SHA1"):
        raise ValueError("sub-command UUID needs NAMESPACE, NAME, and TYPE with MD5 or SHA1")
    make = uuid.uuid5 if options["TYPE"] == "SHA1" else uuid.uuid3
    made = str(make(uuid.UUID(options["NAMESPACE"]), options["NAME"]))
    scope.values[words[0]] = made.upper() if "UPPER" in words else made


def _random(words: list[str], scope: Scope) -> None:
    options = dict(zip(words[:-1:2], words[1:-1:2], strict=False))
    alphabet = options.get("ALPHABET", "qwertyuiopasdfghjklzxcvbnmQWERTYUIOPASDFGHJKLZXCVBNM0123456789")
    generator = random.Random(options.get("RANDOM_SEED"))  # noqa: S311  # for file names, not for secrets
    length = int(options.get("LENGTH", "5"))
    check_length(length)
    scope.values[words[-1]] = "".join(generator.choices(alphabet, k=length))


_OPERATIONS: Mapping[str, Callable[[list[str], Scope], None]] = {
    "FIND": _find,
    "REPLACE": _replace,
    "REGEX": _regex,
    "APPEND": _append,
    "PREPEND": _prepend,
    "CONCAT": _concat,
    "JOIN": _join,
    "TOLOWER": _change(str.lower),
    "TOUPPER": _change(str.upper),
    "LENGTH": _change(lambda text: str(len(text.encode()))),
    "STRIP": _change(lambda text: text.strip()),
    "MAKE_C_IDENTIFIER": _change(
        lambda text: re.sub(r"^(?=\d)", "_", re.sub(r"\W", "_", text, flags=re.ASCII))
    ),
    "HEX": _change(lambda text: text.encode().hex()),
    "SUBSTRING": _substring,
    "REPEAT": _repeat,
    "COMPARE": _compare,
    "ASCII": _ascii,
    "CONFIGURE": _configure,
    "TIMESTAMP": _timestamp,
    "RANDOM": _random,
    "UUID": _uuid,
}


def separate_arguments(words: list[str], scope: Scope) -> None:
    """Execute `separate_arguments(variable [mode] [arguments])`.

    Raises:
        ValueError: the variable is missing, or a quote is not closed.
    """
    if not words:
        raise ValueError("must be given at least one argument")
    name, *rest = words
    if not rest:
        scope.values[name] = scope.values.get(name, "").replace(" ", ";")
        return
    text = " ".join(word for word in rest[1:] if word != "PROGRAM")
    is_windows = rest[0] == "WINDOWS_COMMAND" or (rest[0] == "NATIVE_COMMAND" and ON_WINDOWS)
    found = split_words(text, '"', as_on_windows=is_windows)
    scope.values[name] = ";".join(word.replace(";", "\\;") for word in found)
