"""`ParameterGenerator`, with which a `.cfg` file declares parameters, and the description built from them.

The description consists of nested dictionaries, as in the modules of genuine dynamic_reconfigure.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import sys
from pathlib import Path
from typing import Any

from pipros_libraries.reconfigure.cache import SOURCES, sources

OUTPUT_VARIABLE = "PIPROS_CFG_OUTPUT"
"""Environment variable with the path of the file to which a `.cfg` program writes its declarations."""

TYPES: dict[str, type[Any]] = {"str": str, "bool": bool, "int": int, "double": float}
_C_TYPES = {"str": "std::string", "bool": "bool", "int": "int", "double": "double"}
_C_CONSTANTS = {
    "str": "const char * const",
    "bool": "const bool",
    "int": "const int",
    "double": "const double",
}
_BOUNDS: dict[str, tuple[Any, Any, Any]] = {  # default, minimum, maximum
    "str": ("", "", ""),
    "bool": (False, False, True),
    "int": (0, -(2**31), 2**31 - 1),
    "double": (0.0, -math.inf, math.inf),
}


class Group:
    """A group of parameters and subgroups."""

    def __init__(self, numbers: list[int], name: str, type: str, state: bool, parent: Group | None) -> None:  # noqa: A002
        self.name = _checked_name(name.replace(" ", "_"), "group")
        self.type = type
        self.state = state
        self.id = len(numbers)
        numbers.append(self.id)
        self.parent = parent
        self.parameters: list[dict[str, Any]] = []
        self.groups: list[Group] = []
        self._numbers = numbers
        self._source = _source()

    def add_group(self, name: str, type: str = "", state: bool = True) -> Group:  # noqa: A002
        """Add a subgroup, and return it.

        Raises:
            ValueError: the name is invalid.
        """
        group = Group(self._numbers, name, type, state, self)
        self.groups.append(group)
        return group

    def add(
        self,
        name: str,
        paramtype: str,
        level: int,
        description: str,
        default: object = None,
        min: object = None,  # noqa: A002
        max: object = None,  # noqa: A002
        edit_method: str = "",
    ) -> None:
        """Add a parameter.

        Raises:
            TypeError: a value does not have the parameter's type.
            ValueError: the name or the type is invalid, or a string or bool has bounds.
        """
        if paramtype not in TYPES:
            raise ValueError(f"type of {name} must be one of {', '.join(TYPES)}, got {paramtype!r}")
        if _checked_name(name, "parameter") == "groups":
            raise ValueError("a parameter must not be named groups: a configuration has its groups there")
        if paramtype in ("str", "bool") and (min is not None or max is not None):
            raise ValueError(f"{name} must not have min or max, because its type is {paramtype}")
        values = zip(("default", "min", "max"), (default, min, max), _BOUNDS[paramtype], strict=True)
        # the level is a bit mask; a fraction is dropped, as in C++
        parameter = {"name": name, "type": paramtype, "level": int(level), "description": description}
        for field, value, standard in values:
            parameter[field] = standard if value is None else checked(name, paramtype, field, value)
        parameter |= _source() | {"edit_method": edit_method}
        parameter |= {"ctype": _C_TYPES[paramtype], "cconsttype": _C_CONSTANTS[paramtype]}
        self.parameters.append(parameter)

    def to_dict(self) -> dict[str, Any]:
        """Return the group and its contents as a dictionary."""
        path = self._path()
        parent = self.parent or self
        return {
            "name": self.name,
            "type": self.type,
            "state": self.state,
            "cstate": "true" if self.state else "false",
            "id": self.id,
            "parent": parent.id,
            "parameters": self.parameters,
            "groups": [group.to_dict() for group in self.groups],
            **self._source,
            "class": "::".join(name.upper() for name in path),
            "parentclass": "::".join(name.upper() for name in path[:-1]),
            "parentname": parent.name,
            "field": "::".join([*(name.upper() for name in path[:-1]), self.name.lower()]),
            "upper": self.name.upper(),
            "lower": self.name.lower() if self.parent else "groups",
        }

    def _path(self) -> list[str]:
        return [*(self.parent._path() if self.parent else ()), self.name]


def _checked_name(name: str, kind: str) -> str:
    if not re.fullmatch("[a-zA-Z][a-zA-Z0-9_]*", name):
        raise ValueError(
            f"a {kind} name must begin with a letter and contain only letters, digits and underscores, "
            f"got {name!r}"
        )
    return name


class ParameterGenerator:
    """The parameters that a `.cfg` file declares.

    A call to `generate` at the end of the file writes the declarations.

    `add` and `add_group` add to the root group.
    """

    def __init__(self) -> None:
        self.group = Group([], "Default", "", True, None)
        self.add, self.add_group = self.group.add, self.group.add_group
        self.constants: list[dict[str, Any]] = []

    def const(self, name: str, type: str, value: object, descr: str) -> dict[str, Any]:  # noqa: A002
        """Declare a constant, and return it for use in `enum`.

        Raises:
            KeyError: the type is unknown.
            TypeError: the value does not have the given type.
            ValueError: the description contains quotes.
        """
        constant = {"name": name, "type": type, "value": checked(name, type, "value", value)}
        constant |= _source() | {"description": _without_quotes(descr)}
        constant |= {"ctype": _C_TYPES[type], "cconsttype": _C_CONSTANTS[type]}
        self.constants.append(constant)
        return constant

    def enum(self, constants: list[dict[str, Any]], description: str) -> str:
        """Return the edit method for a parameter whose value must be one of the constants.

        Raises ValueError if there are no constants, their types differ, or `description` contains quotes.
        """
        if len({constant["type"] for constant in constants}) != 1:
            raise ValueError("an enum must have at least one constant, and all of the same type")
        return repr({"enum": constants, "enum_description": _without_quotes(description)})

    def generate(self, pkgname: str, nodename: str, name: str) -> int:  # noqa: ARG002
        """Write the declarations to the file named by `PIPROS_CFG_OUTPUT`. Return the exit code.

        If the variable is unset, print an error and return 1. `pkgname` and `nodename` are ignored.
        """
        output = os.environ.get(OUTPUT_VARIABLE)
        if output is None:
            print(
                "There is no need to run a .cfg file; `from my_pkg.cfg import FooConfig` runs it.",
                file=sys.stderr,
            )
            return 1
        declared: dict[str, Any] = {
            "name": name,
            "description": self.group.to_dict(),
            "constants": self.constants,
        }
        with contextlib.suppress(OSError):  # a module's file was deleted, so nothing is cached
            declared[SOURCES] = sources(list(sys.modules.values()))
        Path(output).write_text(json.dumps(declared), encoding="utf-8")
        return 0


def checked(name: str, type_name: str, field: str, value: object) -> Any:
    """Return the value, with an int converted to float if the parameter's type is double.

    Raises:
        TypeError: the value does not have the parameter's type.
    """
    wanted = TYPES[type_name]
    if type(value) is not wanted and not (wanted is float and type(value) is int):
        raise TypeError(f"{field} of {name} must be of type {type_name}, got {value!r}")
    return wanted(value)


def _without_quotes(description: str) -> str:
    if '"' in description or "'" in description:
        raise ValueError(f"a description must not contain quotes, got {description}")
    return description


def _source() -> dict[str, Any]:
    """Return the line and file name of the innermost caller outside this module: the `.cfg` file."""
    frame = sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename == __file__:
        frame = frame.f_back
    return {"srcline": frame.f_lineno, "srcfile": os.path.basename(frame.f_code.co_filename)}
