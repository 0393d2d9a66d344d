"""The arguments of `rospack` and `rosstack`, which read them in their own way: no `optparse`."""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence


def split_arguments(
    arguments: Sequence[str], value_options: Collection[str], flags: Collection[str]
) -> tuple[list[str], dict[str, str], str]:
    """Words, options, and what is wrong with them; the last is empty if nothing is.

    Args:
        arguments: of the command line.
        value_options: options with a value, which follows `=` or is the next argument.
        flags: options without one. `-h` and `--help` are words unless they are flags.
    """
    words: list[str] = []
    options: dict[str, str] = {}
    left = iter(arguments)
    for argument in left:
        name, sign, value = argument.partition("=")
        if name in value_options:
            if not sign:
                following = next(left, None)
                if following is None:
                    return words, options, f"the required argument for option '{name}' is missing"
                value = following
            options[name] = value
        elif argument in flags:
            options[argument] = "yes"
        elif argument.startswith("-") and argument not in ("-h", "--help"):
            return words, options, f"failed to parse command-line options: unrecognised option '{argument}'"
        else:
            words.append(argument)
    return words, options, ""


TOO_MANY_WORDS = (
    "failed to parse command-line options: "
    "too many positional options have been specified on the command line"
)


def complain(tool: str, text: str, options: Mapping[str, str]) -> int:
    """Prints the error, unless `-q` is given. Returns the exit code."""
    if "-q" not in options:
        print(f"[{tool}] Error: {text}", file=sys.stderr)
    return 1
