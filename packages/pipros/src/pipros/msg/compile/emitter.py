"""Python source under construction, for the message class compiler."""

from __future__ import annotations

import itertools
import keyword
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from pipros.msg.language.spec import DefinitionError, MessageSpec

BLOCK_LIMIT = 16
"""Maximum nesting depth of arrays. Python itself allows 20 nested blocks."""


def python_name(name: str) -> str:
    """Return the attribute name for a field. As in genpy, `from` becomes `from_`."""
    return f"{name}_" if keyword.iskeyword(name) or name == "self" else name


class Names:
    """Global names in the generated module: message classes, `struct` functions and string readers.

    The name of a message class is unique, because it contains the package name and the length of that name.
    """

    def __init__(self) -> None:
        self.classes: dict[str, str] = {}
        self.structs: dict[tuple[str, str], str] = {}
        self.strings: dict[str, str] = {}

    def message_class(self, type_name: str) -> str:
        package, _, name = type_name.partition("/")
        return self.classes.setdefault(type_name, f"_{len(package)}_{package}_{name}")

    def struct_method(self, layout: str, method: str) -> str:
        """Return a name for a little-endian `Struct`'s bound `pack`, `unpack_from` or `iter_unpack`."""
        return self.structs.setdefault((layout, method), f"_{method}_{len(self.structs)}")

    def repeated_strings(self, errors: str) -> str:
        """Return a name for the `read` method of a field's `RepeatedStrings`."""
        name = f"_strings_{len(self.strings)}"
        self.strings[name] = errors
        return name


class Emitter:
    """Lines of a function body, with fresh local names and a limit on nested loops."""

    def __init__(self, names: Names, *, indent: int = 0) -> None:
        self.names = names
        self.lines: list[str] = []
        self._indent = indent
        self._depth = 0
        self._numbers = itertools.count()

    def emit(self, line: str) -> None:
        self.lines.append("    " * self._indent + line)

    def local(self, prefix: str) -> str:
        return f"{prefix}{next(self._numbers)}"

    def assign(self, prefix: str, expression: str) -> str:
        """Emit the assignment of `expression` to a fresh local name, and return the name."""
        name = self.local(prefix)
        self.emit(f"{name} = {expression}")
        return name

    @contextmanager
    def block(self, opening: str) -> Iterator[None]:
        """Emit `opening`, a line that ends with a colon, and indent the lines emitted in the context."""
        self.emit(opening)
        self._indent += 1
        yield
        self._indent -= 1

    @contextmanager
    def captured(self) -> Iterator[list[str]]:
        """Collect lines, without their indentation, to be emitted later."""
        kept, indent = self.lines, self._indent
        self.lines, self._indent = [], 0
        yield self.lines
        self.lines, self._indent = kept, indent

    @property
    def is_looping(self) -> bool:
        """Whether lines are currently emitted inside a `loop`."""
        return self._depth > 0

    @contextmanager
    def loop(self, opening: str, within: MessageSpec) -> Iterator[None]:
        if self._depth >= BLOCK_LIMIT:
            raise DefinitionError(f"arrays are nested deeper than {BLOCK_LIMIT}", file=within.file)
        self._depth += 1
        with self.block(opening):
            yield
        self._depth -= 1


def struct_layout(codes: Sequence[str]) -> str:
    """Return a `struct` format for the codes, abbreviating repeated codes, as in `3d`."""
    parts = []
    for code, group in itertools.groupby(codes):
        count = len(list(group))
        is_counted = code[0].isdigit()
        parts.append(code * count if is_counted or count == 1 else f"{count}{code}")
    return "<" + "".join(parts)
