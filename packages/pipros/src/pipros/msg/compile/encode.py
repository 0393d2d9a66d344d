"""Generate the body of `serialize` for one message type.

Fields such as those of `Header header; float64[9] a; uint8[] data; Point[] points` are packed as follows:

- Consecutive scalars, times, fixed arrays and lengths are packed by one `struct.pack`.
- A message consists of one or more sections, each of which is written by one call. A variable-length array of
  numbers that is not inside another array is a separate section, whose memory can reach the transport without
  a copy. The pieces of any other section are joined once.
- Arrays of messages and strings append their pieces to a list, which is joined.
- Nothing is written until everything is packed, so an invalid message is never partly written.
"""

from __future__ import annotations

from pipros.msg.compile.arrays import SIZES
from pipros.msg.compile.emitter import Emitter, Names, python_name, struct_layout
from pipros.msg.compile.layout import TypeLayout
from pipros.msg.language.spec import NUMBERS, OCTETS, TIMES, FieldType

_WRONG_LENGTH = 'raise _ValueError("a fixed array has the wrong length")'


def serialize_body(layout: TypeLayout, names: Names, *, indent: int) -> list[str]:
    """Return the statements that write `self` to `buff`."""
    encoder = _Encoder(names, indent=indent)
    encoder.fields(layout, "self")
    encoder.finish()
    return encoder.lines or ["    " * indent + "pass"]


class _Encoder(Emitter):
    def __init__(self, names: Names, *, indent: int) -> None:
        super().__init__(names, indent=indent)
        self._codes: list[str] = []
        self._values: list[str] = []
        self._fixed_arrays: list[tuple[str, int]] = []
        self._pieces: list[str] = []
        self._list: str | None = None
        self._stretches: list[str] = []

    def fields(self, layout: TypeLayout, owner: str) -> None:
        for field in layout.spec.fields:
            value = f"{owner}.{python_name(field.name)}"
            if not field.type.is_array:
                self._single(field.type.base, value, layout)
            elif field.type.base in OCTETS or field.type.base in NUMBERS:
                self._numbers_array(field.type, value)
            else:
                self._loop(field.type, value, layout)

    def finish(self) -> None:
        self._end_stretch()
        if len(self._stretches) > 1:
            self._stretches = [
                part if part.isidentifier() else self.assign("w", part) for part in self._stretches
            ]
        for part in self._stretches:
            self.emit(f"buff.write({part})")

    def _single(self, base: str, value: str, within: TypeLayout) -> None:
        if base in NUMBERS:
            self._scalar(_pack_code(base), value)
        elif base in TIMES:
            time = self.assign("t", value)
            for code, part in zip(TIMES[base], ("secs", "nsecs"), strict=True):
                self._scalar(code, f"{time}.{part}")
        elif base == "string":
            text = self.assign("s", f"{value}.encode()")
            self._scalar("I", f"_len({text})")
            self._piece(text)
        else:
            inner = within.members[base]
            if inner.spec.fields:
                self.fields(inner, value if value.isidentifier() else self.assign("m", value))

    def _numbers_array(self, kind: FieldType, value: str) -> None:
        code = _pack_code(kind.base)
        is_octets = kind.base in OCTETS
        if kind.length is not None:
            if is_octets:
                self._scalar(f"{kind.length}s", f"_fixed_octets({value}, {kind.length})")
            else:
                array = self.assign("a", value)
                self._fixed_arrays.append((array, kind.length))
                self._scalar(f"{kind.length}{code}", f"*{array}")
            return
        packed = self.assign("a", f"_octets({value})" if is_octets else f"_numbers({code!r}, {value})")
        size = SIZES[code]
        self._scalar("I", f"_len({packed})" if size == 1 else f"_len({packed}) // {size}")
        self._flush()
        if self.is_looping:
            self._piece(packed)
        else:
            self._end_stretch()
            self._stretches.append(packed)

    def _loop(self, kind: FieldType, value: str, within: TypeLayout) -> None:
        array = self.assign("a", value)
        if kind.length is None:
            self._scalar("I", f"_len({array})")
        else:
            with self.block(f"if _len({array}) != {kind.length}:"):
                self.emit(_WRONG_LENGTH)
        inner = within.members.get(kind.base)
        if inner is not None and inner.only_code is not None:
            names = [python_name(field.name) for field in inner.spec.fields]
            parts = ", ".join(f"e.{name}" for name in names)
            layout = f"f'<{{_len({array}) * {len(names)}}}{inner.only_code}'"
            self._piece(f"_struct.pack({layout}, *[v for e in {array} for v in ({parts},)])")
            return
        self._flush()
        self._append_pieces()
        element = self.local("e")
        with self.loop(f"for {element} in {array}:", within.spec):
            self._single(kind.base, element, within)
            self._flush()
            if self._pieces:
                self._append_pieces()
            else:
                self.emit("pass")

    def _scalar(self, code: str, value: str) -> None:
        self._codes.append(code)
        self._values.append(value)

    def _piece(self, expression: str) -> None:
        self._flush()
        self._pieces.append(expression)

    def _flush(self) -> None:
        """Emit code that packs the scalars collected so far."""
        if len(self._fixed_arrays) > 1:
            # `pack` detects one array of the wrong length, but not two whose errors cancel out.
            for array, length in self._fixed_arrays:
                with self.block(f"if _len({array}) != {length}:"):
                    self.emit(_WRONG_LENGTH)
        self._fixed_arrays = []
        if self._codes:
            pack = self.names.struct_method(struct_layout(self._codes), "pack")
            self._pieces.append(f"{pack}({', '.join(self._values)})")
        self._codes, self._values = [], []

    def _append_pieces(self) -> None:
        """Emit code that appends the pieces collected so far to the section's list."""
        if self._list is None:
            self._list = self.local("parts")
            self.emit(f"{self._list} = [{', '.join(self._pieces)}]")
            self.emit(f"add = {self._list}.append")
        elif self._pieces:
            self.emit(f"add({_joined(self._pieces)})")
        self._pieces = []

    def _end_stretch(self) -> None:
        self._flush()
        if self._list is not None:
            if self._pieces:
                self._append_pieces()
            self._stretches.append(self.assign("w", f'b"".join({self._list})'))
        elif self._pieces:
            self._stretches.append(_joined(self._pieces))
        self._list, self._pieces = None, []


def _pack_code(base: str) -> str:
    """Return the `struct` code for a type.

    As in genpy, a bool is written as a number: 2 stays 2, and -1 is refused.
    """
    return "B" if base == "bool" else NUMBERS[base]


def _joined(pieces: list[str]) -> str:
    if len(pieces) <= 2:
        return " + ".join(pieces)
    return f'b"".join(({", ".join(pieces)}))'
