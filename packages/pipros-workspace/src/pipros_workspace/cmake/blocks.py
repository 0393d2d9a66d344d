"""Find the ends of blocks, and the branches of `if()`, in a list of commands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pipros_workspace.cmake.language import Command

BLOCKS = ("if", "foreach", "while", "function", "macro", "block")


def end_of_block(commands: Sequence[Command], start: int) -> int | None:
    """Return the position of the command that closes the block opened at `start`, or None."""
    name = commands[start].name
    depth = 0
    for position in range(start, len(commands)):
        depth += commands[position].name == name
        depth -= commands[position].name == f"end{name}"
        if depth == 0:
            return position
    return None


def branches(opening: Command, body: Sequence[Command]) -> Iterator[tuple[Command, Sequence[Command]]]:
    """Yield each branch of an `if()` block: its `if()`, `elseif()` or `else()` command, and its body."""
    depth, start, branch = 0, 0, opening
    for position, command in enumerate(body):
        depth += command.name == "if"
        depth -= command.name == "endif"
        if depth == 0 and command.name in ("elseif", "else"):
            yield branch, body[start:position]
            branch, start = command, position + 1
    yield branch, body[start:]
