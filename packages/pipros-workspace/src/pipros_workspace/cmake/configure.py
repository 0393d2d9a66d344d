"""The command `configure_file()`, which substitutes variables in text."""

from __future__ import annotations

import re
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.basics.limits import process_limits
from pipros.basics.replaced_file import write_whole
from pipros_workspace.cmake.condition import is_on
from pipros_workspace.cmake.scope import Scope, check_length


def configure_file(words: list[str], scope: Scope) -> None:
    """Execute `configure_file(input output …)`. The output is not written if it is up to date.

    Raises:
        ValueError: there are too few arguments, a file cannot be read or written, or the result would be too
            long.
    """
    if len(words) < 2:
        raise ValueError("called with incorrect number of arguments, expected 2")
    source, target = Path(scope.in_source(words[0])), Path(scope.in_binary(words[1]))
    if target.is_dir():
        target /= source.name
    try:
        content = read_file(source, process_limits().file_bytes)
        if "COPYONLY" not in words:
            text = configured(content.decode("utf-8", "surrogateescape"), scope, at_only="@ONLY" in words,
                              escapes_quotes="ESCAPE_QUOTES" in words)  # fmt: skip
            if text and not text.endswith("\n"):
                text += "\n"
            content = text.encode("utf-8", "surrogateescape")
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.is_file() or read_file(target) != content:
            write_whole(target, content)
        target.chmod(source.stat().st_mode)
    except OSError as error:
        raise ValueError(f"{error.filename}: {error.strerror}") from None


_DEFINE = re.compile(r"^([ \t]*#[ \t]*)cmakedefine(01)?[ \t]+(\w+)(?:[ \t]+([^\n]*))?$", re.MULTILINE)


def configured(text: str, scope: Scope, *, at_only: bool = False, escapes_quotes: bool = False) -> str:
    """Return `text` with `#cmakedefine` lines, `@NAME@` and, unless `at_only` is true, `${NAME}` replaced.

    Raises:
        ValueError: the result would be too long.
    """
    values = scope.values
    made = 0

    def define(match: re.Match[str]) -> str:
        hash_sign, as_number, name, rest = match.groups()
        is_set = is_on(values.get(name, ""))
        if as_number:
            return f"{hash_sign}define {name} {'' if rest is None else rest + ' '}{int(is_set)}"
        if is_set:
            return f"{hash_sign}define {name}" + (f" {rest}" if rest is not None else "")
        return f"/* #undef {name} */"

    def replace(match: re.Match[str]) -> str:
        nonlocal made
        if match[1] == "ENV":
            return scope.environment.get(match[2], "")
        value = values.get(match[2] or match[3], "")
        made += len(value)
        check_length(made)
        return value.replace('"', '\\"') if escapes_quotes else value

    text = _DEFINE.sub(define, text)
    references = r"()()@([\w/.+-]+)@" if at_only else r"\$(ENV)?\{([\w/.+-]+)\}|@([\w/.+-]+)@"
    return re.sub(references, replace, text)
