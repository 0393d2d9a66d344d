"""Parse ROS 2 `.msg`, `.srv` and `.action` files (https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html).

The language extends the ROS 1 language with bounded strings and sequences, `wstring`, and default values. It
lacks `time`, `duration` and the short form `Header`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from pipros.msg.language.digest import SEPARATOR
from pipros.msg.language.parse import SECTION_MARK
from pipros.msg.language.spec import DefinitionError
from pipros_rosbag2.interfaces.action_types import Ros2Action
from pipros_rosbag2.interfaces.parts import owner_of, parts_of
from pipros_rosbag2.interfaces.spec import (
    NO_FIELDS,
    PRIMITIVES,
    Form,
    Ros2Constant,
    Ros2Field,
    Ros2Message,
    Ros2Service,
    Ros2Type,
)

_FULL_NAME = re.compile(r"[A-Za-z]\w*/(msg|srv|action)/[A-Za-z]\w*", re.ASCII)
_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_TYPE = re.compile(
    r"(?P<base>[A-Za-z][\w/]*)(<=(?P<characters>\d{1,10}))?"
    r"(?P<array>\[(?P<bounded><=)?(?P<length>\d{0,10})\])?",
    re.ASCII,
)
_CONSTANT = re.compile(
    r"(?P<type>[a-z]\w*(<=\d+)?)\s+(?P<name>[A-Za-z]\w*)\s*=\s*(?P<value>.*)", re.ASCII | re.DOTALL
)
_LENGTH_LIMIT = 1 << 26
"""Maximum length of an array, and maximum bound of a string or sequence."""


def is_full_name(name: str) -> bool:
    """Return whether a name has the form `package/msg/Name`, or `srv` or `action` in place of `msg`."""
    return _FULL_NAME.fullmatch(name) is not None


def parse_ros2_message(text: str, type_name: str, file: str = "") -> Ros2Message:
    """Parse a message definition.

    Raises:
        DefinitionError: the definition is invalid.
    """
    file = file or f"<definition of {type_name}>"
    if not is_full_name(type_name):
        raise DefinitionError(
            f"a type name must have the form package/msg/Name, got [{type_name}]", file=file
        )
    package = type_name.partition("/")[0]
    fields: dict[str, Ros2Field] = {}
    constants: dict[str, Ros2Constant] = {}
    for number, line in enumerate(text.split("\n"), 1):
        declaration = _without_comment(line).strip()
        if not declaration:
            continue
        constant = _CONSTANT.fullmatch(declaration)
        try:
            if constant is not None and constant["type"].partition("<")[0] in PRIMITIVES:
                name = constant["name"]
                made = Ros2Constant(constant["type"], name, constant["value"].strip())
                added = constants.setdefault(name, made) is made
            else:
                field = _field(declaration, package)
                name = field.name
                added = fields.setdefault(name, field) is field
            if not added:
                raise ValueError(f"{name} is declared twice")
        except ValueError as error:
            raise DefinitionError(str(error), file=file, line=number, column=1) from None
    return Ros2Message(type_name, tuple(fields.values()) or (NO_FIELDS,), tuple(constants.values()), file)


def parse_ros2_service(text: str, type_name: str, file: str = "") -> Ros2Service:
    """Parse a service definition. Raises the same errors as `parse_ros2_message`."""
    request, response = _sections(text, ("request", "response"), file or type_name)
    return Ros2Service(
        type_name,
        parse_ros2_message(request, f"{type_name}_Request", file),
        parse_ros2_message(response, f"{type_name}_Response", file),
    )


def parse_ros2_action(text: str, type_name: str, file: str = "") -> Ros2Action:
    """Parse an action definition. Raises the same errors as `parse_ros2_message`."""
    goal, result, feedback = _sections(text, ("goal", "result", "feedback"), file or type_name)
    return Ros2Action(
        type_name,
        parse_ros2_message(goal, f"{type_name}_Goal", file),
        parse_ros2_message(result, f"{type_name}_Result", file),
        parse_ros2_message(feedback, f"{type_name}_Feedback", file),
    )


def messages_from_text(type_name: str, text: str) -> dict[str, Ros2Message]:
    """Return the definitions in the text of a bag's schema (`ros2msg`), by name.

    For a message that belongs to a service or an action, the text may begin with the definition of the whole
    service or action.

    Raises:
        DefinitionError: a definition is invalid.
    """
    head, *others = re.split(rf"^{SEPARATOR}\s*\n", text.replace("\r\n", "\n"), flags=re.MULTILINE)
    if others and not head.strip() and others[0].startswith(("SRV: ", "ACTION: ")):
        _, _, head = others.pop(0).partition("\n")
    found = _messages_of_head(type_name, head)
    for part in others:
        title, _, body = part.partition("\n")
        if not title.startswith("MSG: "):
            raise DefinitionError("expected MSG: package/Name after a separator", file=f"<{type_name}>")
        name = full_name(title.removeprefix("MSG: ").strip())
        if name not in found:
            found[name] = parse_ros2_message(body, name)
    return found


def _messages_of_head(type_name: str, text: str) -> dict[str, Ros2Message]:
    owner = owner_of(type_name)
    if not owner or SECTION_MARK not in map(str.strip, text.split("\n")):
        return {type_name: parse_ros2_message(text, type_name)}
    parse = parse_ros2_service if "/srv/" in owner else parse_ros2_action
    return dict(parts_of(parse(text, owner)))


def full_name(name: str, package: str = "") -> str:
    """Return the three-part name for `Name`, `package/Name` or `package/msg/Name`.

    >>> full_name("std_msgs/String")
    'std_msgs/msg/String'
    """
    parts = name.split("/")
    if len(parts) == 1:
        return f"{package}/msg/{name}"
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def _sections(text: str, names: Sequence[str], file: str) -> list[str]:
    """Return the parts separated by `---` lines.

    Each part starts with empty lines in place of the earlier parts, so that its line numbers stay correct.
    """
    parts: list[list[str]] = [[]]
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip() == SECTION_MARK:
            parts.append([""] * number)
        else:
            parts[-1].append(line)
    if len(parts) != len(names):
        raise DefinitionError(
            f"expected the parts {', '.join(names)}, separated by {SECTION_MARK} lines, "
            f"got {len(parts)} of them",
            file=file,
        )
    return ["\n".join(part) for part in parts]


def _field(declaration: str, package: str) -> Ros2Field:
    type_text, _, rest = declaration.replace("\t", " ").partition(" ")
    name, _, default = rest.strip().partition(" ")
    match = _TYPE.fullmatch(type_text)
    if match is None:
        raise ValueError(f"[{type_text}] is not a type")
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"a field name must begin with a letter and contain only letters, digits and _, got [{name}]"
        )
    base, characters = match["base"], int(match["characters"] or 0)
    if base not in PRIMITIVES:
        base = full_name(base, package)
        if not is_full_name(base):
            raise ValueError(f"[{type_text}] is not a type")
    if characters and base not in ("string", "wstring"):
        raise ValueError(f"[{type_text}]: only strings have a maximum length")
    form, length = Form.SINGLE, int(match["length"] or 0)
    if match["array"]:
        form = Form.BOUNDED if match["bounded"] else Form.ARRAY if match["length"] else Form.SEQUENCE
        if form is not Form.SEQUENCE and not length:
            raise ValueError(f"[{type_text}]: the length must be at least 1")
    if max(length, characters) > _LENGTH_LIMIT:
        raise ValueError(f"[{type_text}]: a length or bound must be at most {_LENGTH_LIMIT}")
    return Ros2Field(Ros2Type(base, form, length, characters), name, default.strip())


def _without_comment(line: str) -> str:
    """Return the line up to the first `#` outside quotes."""
    if "#" not in line or not ('"' in line or "'" in line):
        return line.partition("#")[0]
    quote = ""
    for at, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character == "#":
            return line[:at]
    return line.partition("#")[0] if quote else line


def embedded_names(message: Ros2Message) -> Iterator[str]:
    """Yield the type name of each field whose type is a message. Names may repeat."""
    for field in message.fields:
        if not field.type.is_primitive:
            yield field.type.base
