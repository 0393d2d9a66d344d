"""Type stubs (`.pyi`) for the messages and services of ROS packages, for editors and type checkers.

Reading an array of octets or numbers yields the type that received messages contain (`bytes` or a sequence).
Such a field can be set to any value that the codec accepts, such as a numpy array. Comments in the
definitions become docstrings.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.basics.printable import printable_lines
from pipros.basics.replaced_file import write_whole
from pipros.msg.compile.emitter import python_name
from pipros.msg.language.comments import comments_of
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import (
    FLOATS,
    INTEGERS,
    NUMBERS,
    OCTETS,
    TIMES,
    Constant,
    FieldType,
    MessageSpec,
    ServiceSpec,
)

_IMPORTS = {
    "_Sequence": "from collections.abc import Sequence as _Sequence",
    "_ClassVar": "from typing import ClassVar as _ClassVar",
    "_Final": "from typing import Final as _Final",
    "_base": "from pipros.msg import base as _base",
    "_types": "from pipros.msg import stub_types as _types",
    "_time": "from pipros.msg import time as _time",
}


def write_stubs(
    packages: Iterable[str],
    folder: Path,
    definitions: Definitions,
    *,
    suffix: str = "",
    has_module: Callable[[str], bool] = lambda _: False,
) -> list[Path]:
    """Write the stubs for packages, in files such as `<folder>/<package><suffix>/msg/__init__.pyi`.

    Args:
        suffix: `-stubs` for installed packages (PEP 561), or empty for a folder of stubs.
        has_module: returns whether a package has other Python modules, which the stubs must not hide.

    Returns:
        The paths of all stub files, including unchanged ones.

    Raises:
        NotFound: a package does not exist.
        DefinitionError: a definition is invalid.
        OSError: a file cannot be written.
    """
    written = []
    for package in packages:
        texts = package_stubs(package, definitions, has_module=has_module(package))
        for name, text in texts.items():
            file = folder / f"{package}{suffix}" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            # do not rewrite unchanged files, because editors reload files that change
            if not file.is_file() or read_file(file) != text.encode():
                write_whole(file, text.encode())
            written.append(file)
        outdated = folder / f"{package}{suffix}" / "__init__.pyi"
        if texts and "__init__.pyi" not in texts:
            outdated.unlink(missing_ok=True)
    return written


def package_stubs(package: str, definitions: Definitions, *, has_module: bool = False) -> dict[str, str]:
    """Return the stubs for one package, as a mapping from the path within the package to the contents.

    If the package has other Python modules, there is no `__init__.pyi`, and `py.typed` says `partial`
    (PEP 561), so that type checkers read these modules too.

    Raises `NotFound` or `DefinitionError` like `write_stubs`.
    """
    stubs: dict[str, str] = {}
    messages = [definitions.message(f"{package}/{name}") for name in definitions.files.names("msg", package)]
    services = [definitions.service(f"{package}/{name}") for name in definitions.files.names("srv", package)]
    if messages:
        stubs["msg/__init__.pyi"] = _module("Messages", package, messages, [])
    if services:
        halves = [half for service in services for half in (service.request, service.response)]
        stubs["srv/__init__.pyi"] = _module("Services", package, halves, services)
    if stubs:
        stubs["py.typed" if has_module else "__init__.pyi"] = "partial\n" if has_module else ""
    return stubs


def _module(what: str, package: str, messages: Sequence[MessageSpec], services: Sequence[ServiceSpec]) -> str:
    home = f"{package}.{'srv' if services else 'msg'}"
    imports = sorted(
        {
            f"{field.type.base.partition('/')[0]}.msg"
            for message in messages
            for field in message.fields
            if not field.type.is_builtin
        }
        - {home}
    )
    classes = [_message(message, home) for message in messages]
    classes += [_service(service) for service in services]
    used = set(re.findall(r"\b_\w+", "".join(classes)))
    head = [f'"""{what} of {package}, made from their definitions by `pipros stubs`."""', ""]
    head += [line for name, line in _IMPORTS.items() if name in used]
    head += [f"import {name}" for name in imports]
    return "\n".join((*head, "", *classes))


def _message(spec: MessageSpec, home: str) -> str:
    comments = comments_of(spec.text)
    lines = [f"class {spec.name}(_base.Message):", *_docstring(comments.head)]
    for constant in spec.constants:
        lines.append(f"    {python_name(constant.name)}: _Final = {_value(constant)}")
        lines += _docstring(comments.of.get(constant.name, ""))
    arguments = ["self"]
    for field in spec.fields:
        name = python_name(field.name)
        read, written = _types(field.type, home)
        comment = comments.of.get(field.name, "")
        arguments.append(f"{name}: {written} | None = ...")
        if read == written:
            lines += [f"    {name}: {read}", *_docstring(comment)]
        else:
            body = [":", *_docstring(comment, "        ")] if comment else [": ..."]
            lines += ["    @property", f"    def {name}(self) -> {read}{body[0]}", *body[1:]]
            lines += [f"    @{name}.setter", f"    def {name}(self, value: {written}) -> None: ..."]
    lines.append(f"    def __init__({', '.join(arguments)}) -> None: ...")
    return "\n".join((*lines, ""))


def _service(spec: ServiceSpec) -> str:
    lines = [f"class {spec.type.partition('/')[2]}:", *_docstring(comments_of(spec.request.text).head)]
    lines += [
        "    _type: _ClassVar[str]",
        "    _md5sum: _ClassVar[str]",
        f"    _request_class: _ClassVar[type[{spec.request.name}]]",
        f"    _response_class: _ClassVar[type[{spec.response.name}]]",
    ]
    return "\n".join((*lines, ""))


def _docstring(comment: str, indent: str = "    ") -> list[str]:
    """Return the lines of a docstring, or no lines for an empty comment.

    Quotes and backslashes in the comment are escaped.
    """
    if not comment:
        return []
    text = printable_lines(comment).replace("\\", "\\\\").replace('"', '\\"')
    return [f"{indent}{line}".rstrip() for line in f'"""{text}"""'.split("\n")]


def _types(kind: FieldType, home: str) -> tuple[str, str]:
    """Return the type of a field when read, and the type of values that can be assigned to the field."""
    single = _single_type(kind.base, home)
    if not kind.is_array:
        return single, single
    if kind.base in OCTETS:
        return "bytes", "_types.Octets"
    if kind.base in NUMBERS and kind.base != "bool":
        return f"_Sequence[{single}]", f"_types.Array[{single}]"
    return f"list[{single}]", f"list[{single}]"


def _single_type(base: str, home: str) -> str:
    if base in INTEGERS:
        return "int"
    if base in FLOATS:
        return "float"
    if base in ("bool", "string"):
        return {"bool": "bool", "string": "str"}[base]
    if base in TIMES:
        return f"_time.{base.title()}"
    package, _, name = base.partition("/")
    return name if f"{package}.msg" == home else f"{package}.msg.{name}"


def _value(constant: Constant) -> str:
    value = constant.value
    return repr(value) if not isinstance(value, float) or value - value == 0 else "1e999"
