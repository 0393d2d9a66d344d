"""Full texts of message definitions, as used in connection headers and bags.

The full text of a type is its definition, followed by the definitions of all types embedded in it.
"""

from __future__ import annotations

from pipros.msg.language.digest import SEPARATOR
from pipros.msg.language.parse import parse_message
from pipros.msg.language.spec import HEADER, DefinitionError, MessageSpec

DEFINITION_BYTES = 4 * 1024 * 1024
"""Limit: the text of a message definition from a peer or a bag. Beyond it, the definition is refused."""
DEFINITION_TYPES = 1000
"""Limit: types in one definition. Beyond it, the definition is refused."""

_OLD_HEADER = "roslib/Header"  # the name of std_msgs/Header in old bags


def specs_from_text(type_name: str, full_text: str) -> dict[str, MessageSpec]:
    """Return the definitions in a full text, keyed by type. The definition of `type_name` comes first.

    Args:

    Raises:
        DefinitionError: a definition is invalid, or the text exceeds the limits.
    """
    where = f"<definition of {type_name}>"
    if len(full_text) > DEFINITION_BYTES:
        raise DefinitionError(f"the text is longer than {DEFINITION_BYTES} characters", file=where)
    full_text = full_text.replace("\r\n", "\n")  # as in a file read in text mode
    parts: dict[str, list[str]] = {}
    current = parts[type_name] = []
    expects_name = False
    for line in full_text.split("\n"):
        if expects_name:
            if not line.startswith("MSG: "):
                raise DefinitionError("a separator must be followed by MSG: package/Name", file=where)
            name = line.removeprefix("MSG: ").strip()
            current = parts[HEADER if name == _OLD_HEADER else name] = []
            expects_name = False
        elif line.startswith(SEPARATOR):
            expects_name = True
        else:
            current.append(line)
    if len(parts) > DEFINITION_TYPES:
        raise DefinitionError(f"the definition has more than {DEFINITION_TYPES} types", file=where)
    return {name: parse_message("\n".join(lines), name) for name, lines in parts.items()}
