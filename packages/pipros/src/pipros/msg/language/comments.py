"""The comments in a definition: for the whole definition, its fields and its constants.

Comments have no meaning in the language. By convention, a comment belongs to the declaration on its line or
directly below it, and the comment at the top belongs to the whole definition.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pipros.msg.language.parse import ACTION_NOTE


@dataclass(frozen=True, slots=True)
class Comments:
    """Comments without their `#`, with `\\n` between lines.

    Attributes:
        head: the comment for the whole definition; may be empty.
        of: the comments for fields and constants, by name. Names without a comment are missing.
    """

    head: str
    of: Mapping[str, str]


def comments_of(text: str) -> Comments:
    """Return the comments in the definition of a message, or of one part of a service or action.

    All comments before the first declaration form the head. If they consist of several blocks separated by
    empty lines, and the last block directly precedes the declaration, that block belongs to the declaration.

    >>> comments_of("# A reading.\\n\\nfloat64 x  # metres\\n")
    Comments(head='A reading.', of={'x': 'metres'})
    """
    head: list[str] = []
    block: list[str] = []
    of: dict[str, str] = {}
    is_first = True
    for line in text.removeprefix(ACTION_NOTE).split("\n"):
        declaration, mark, behind = (part.strip() for part in line.partition("#"))
        if declaration:
            if is_first and not head:
                head, block = block, []
            if declaration.startswith("string ") and "=" in declaration:
                behind = ""  # in a string constant, `#` is part of the value
            name = _declared_name(declaration)
            of[name] = "\n".join(filter(None, (_joined(block), behind.lstrip("#").strip())))
            is_first, block = False, []
        elif mark:
            block.append(line.strip().lstrip("#").removeprefix(" "))
        else:  # an empty line ends a comment block
            if is_first:
                head += ["", *block] if head else block
            block = []
    if is_first:
        head += block
    return Comments(_joined(head), {name: comment for name, comment in of.items() if comment})


def _declared_name(declaration: str) -> str:
    return declaration.partition("=")[0].split()[-1]


def _joined(lines: list[str]) -> str:
    return "\n".join(lines).strip("\n")
