"""Read `.idl` files of ROS 2: the subset of IDL 4.2 that its generators accept.

See https://design.ros2.org/articles/idl_interface_definition.html. Types of which ROS 1 has no counterpart
(`char`, which is not an octet, `wchar`, `long double`, enumerations, unions) are refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from pipros.msg.language.spec import DefinitionError
from pipros_rosbag2.interfaces.spec import Form, Ros2Constant, Ros2Field, Ros2Message, Ros2Type

_TOKEN = re.compile(
    r'(?P<string>"(?:[^"\\]+|\\.){0,9999}(?:"|(?P<open>)))|(?P<word>[A-Za-z_]\w*(?:::[A-Za-z_]\w*){0,99})'
    r"|(?P<number>[-+]?\.?\d[\w.]*(?:(?<=[eE])[-+]\d+)?)|(?P<sign>[^\s])",
    re.ASCII,
)
# Each alternative also matches what does not end, so that reading takes linear time.
_KEEP_STRINGS = re.compile(
    r'"(?:[^"\\]+|\\.){0,9999}"?|//[^\n]*|/\*(?:.*?\*/|.*)|^[^\S\n]*#[^\n]*', re.DOTALL | re.MULTILINE
)
_DEPTH_LIMIT = 100
"""Maximum number of modules within each other."""
_TYPES = {
    **{name: name for sign in ("", "u") for name in (f"{sign}int{bits}" for bits in (8, 16, 32, 64))},
    "boolean": "bool",
    "octet": "byte",
    "float": "float32",
    "double": "float64",
    "short": "int16",
    "long": "int32",
    "long long": "int64",
    "unsigned short": "uint16",
    "unsigned long": "uint32",
    "unsigned long long": "uint64",
}
_SPELLED = {"TRUE": "true", "FALSE": "false"}
_LENGTH_LIMIT = 1 << 26
_NESTED = "arrays of arrays have no counterpart in ROS 1"


def parse_idl(text: str, file: str) -> dict[str, Ros2Message]:
    """Return the structures of a file, with their constants, by name: `package/msg/Name`.

    The parts of services and actions have the names `package/srv/Name_Request`, `package/action/Name_Goal`, …

    Raises:
        DefinitionError: the file is invalid, or contains a type that ROS 1 cannot express.
    """
    return _Reader(text, file).read()


class _Reader:
    def __init__(self, text: str, file: str) -> None:
        kept = _KEEP_STRINGS.sub(lambda match: match[0] if match[0].startswith('"') else " ", text)
        self._at = 0
        self._file = file
        self._tokens = []
        for match in _TOKEN.finditer(kept):
            if match["open"] is not None:
                raise self._error("a string does not end")
            self._tokens.append(match[0])
        self._scope: list[str] = []
        self._aliases: dict[str, Ros2Type] = {}
        self._constants: dict[str, list[Ros2Constant]] = {}
        self._found: dict[str, Ros2Message] = {}

    def read(self) -> dict[str, Ros2Message]:
        self._definitions("")
        return {
            name: replace(message, constants=tuple(self._constants.get(f"{name}_Constants", ())))
            for name, message in self._found.items()
        }

    def _definitions(self, end: str) -> None:
        """Read definitions until `end`, or until the end of the file if it is empty."""
        kinds: dict[str, Callable[[], None]] = {
            "module": self._module,
            "struct": self._struct,
            "typedef": self._typedef,
            "const": self._constant,
        }
        while (word := self._next(may_end=not end)) != end:
            if word == "@":
                self._annotation()
            elif word in kinds:
                kinds[word]()
            elif word != ";":
                raise self._error(f"expected a definition, got [{word}]")

    def _module(self) -> None:
        self._scope.append(self._name())
        if len(self._scope) > _DEPTH_LIMIT:
            raise self._error("modules are nested too deeply")
        self._expect("{")
        self._definitions("}")
        self._scope.pop()

    def _struct(self) -> None:
        name = "/".join([*self._scope, self._name()])
        self._expect("{")
        fields: list[Ros2Field] = []
        default = ""
        while (word := self._next()) != "}":
            if word == "@":
                default = self._annotation() or default
                continue
            kind = self._type(word)
            while word != ";":
                field, word = self._declared(kind)
                array = field.type.form in (Form.ARRAY, Form.BOUNDED, Form.SEQUENCE)
                fields.append(replace(field, default=_list(default) if array else default))
            default = ""
        self._found[name] = Ros2Message(name, tuple(fields), (), self._file)

    def _typedef(self) -> None:
        kind, word = self._type(self._next()), ","
        while word != ";":
            field, word = self._declared(kind)
            self._aliases[field.name] = field.type

    def _constant(self) -> None:
        kind, name = self._type(self._next()), self._name()
        self._expect("=")
        text = self._value(";")
        self._constants.setdefault("/".join(self._scope), []).append(Ros2Constant(str(kind), name, text))

    def _declared(self, kind: Ros2Type) -> tuple[Ros2Field, str]:
        """Read a name that may be an array, and the word after it."""
        name, word = self._name(), self._next()
        if word == "[":
            kind = replace(kind, form=self._single(kind, Form.ARRAY), length=self._length())
            self._expect("]")
            word = self._next()
        if word not in (",", ";"):
            raise self._error(f"expected ; after {name}, got [{word}]")
        return Ros2Field(kind, name), word

    def _type(self, word: str) -> Ros2Type:
        if word == "sequence":
            self._expect("<")
            if self._peek() == "sequence":
                raise self._error(_NESTED)
            kind = self._type(self._next())
            form, length = self._single(kind, Form.SEQUENCE), 0
            if (after := self._next()) == ",":
                form, length, after = Form.BOUNDED, self._length(), self._next()
            if after != ">":
                raise self._error(f"expected > after a sequence, got [{after}]")
            return replace(kind, form=form, length=length)
        if word in ("string", "wstring"):
            bound = 0
            if self._peek() == "<":
                self._next()
                bound = self._length()
                self._expect(">")
            return Ros2Type(word, string_bound=bound)
        while word in ("unsigned", "long", "unsigned long") and self._peek() in ("long", "short", "double"):
            word = f"{word} {self._next()}"
        if word in self._aliases:
            return self._aliases[word]
        if word in _TYPES:
            return Ros2Type(_TYPES[word])
        if "::" in word:
            return Ros2Type(word.replace("::", "/"))
        raise self._error(f"[{word}] is not a type that ROS 1 can express")

    def _single(self, kind: Ros2Type, form: Form) -> Form:
        if kind.form is not Form.SINGLE:
            raise self._error(_NESTED)
        return form

    def _annotation(self) -> str:
        """Skip an annotation, and return the value of `@default(value=…)`, or an empty string."""
        name = self._name()
        if self._peek() != "(":
            return ""
        self._next()
        if name != "default":
            depth = 1
            while depth:
                depth += {"(": 1, ")": -1}.get(self._next(), 0)
            return ""
        self._expect("value")
        self._expect("=")
        return self._value(")")

    def _value(self, end: str) -> str:
        words = []
        while (word := self._next()) != end:
            words.append(_SPELLED.get(word, word))
        if words and words[0].startswith('"'):
            return f'"{"".join(word[1:-1] for word in words)}"'
        return "".join(words)

    def _length(self) -> int:
        word = self._next()
        if not word.isdecimal() or not 0 < int(word) <= _LENGTH_LIMIT:
            raise self._error(f"a length must be a number from 1 to {_LENGTH_LIMIT}, got [{word}]")
        return int(word)

    def _name(self) -> str:
        word = self._next()
        if not re.fullmatch(r"[A-Za-z_]\w*", word, re.ASCII):
            raise self._error(f"expected a name, got [{word}]")
        return word

    def _expect(self, word: str) -> None:
        if (found := self._next()) != word:
            raise self._error(f"expected {word}, got [{found}]")

    def _peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _next(self, *, may_end: bool = False) -> str:
        word = self._peek()
        if not word and not may_end:
            raise self._error("the file ends within a definition")
        self._at += 1
        return word

    def _error(self, reason: str) -> DefinitionError:
        return DefinitionError(reason, file=self._file)


def _list(default: str) -> str:
    """Return the default value of an array as in `.msg` files: `"(1, 2)"` becomes `[1, 2]`."""
    inner = default.strip('"')[1:-1]
    return f"[{inner}]" if default else ""
