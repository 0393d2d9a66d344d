"""Generate the body of `deserialize` for one message type.

Theory of operation:

- Consecutive scalars, times, fixed arrays and lengths are read by one `struct.unpack_from`.
  They are collected in `_codes` and `_targets` until `_flush`. Statements that need their values, such as
  those that build a fixed array, are deferred in `_afterwards`.
- The offset of the next byte is `_base + _delta`: the sum of a local variable of the generated code, if any,
  and a constant.
- A slice that extends beyond the data is detected by the next `unpack_from`, or by a check that is emitted
  at the end if `_is_end_checked` is false.
- Memory is allocated only for bytes that have arrived, never for a claimed length. If an array's elements may
  contain more values than their size suggests, the code first subtracts the excess values from a limit
  (`allowed`).
"""

from __future__ import annotations

import struct

from pipros.msg.compile.emitter import Emitter, Names, python_name, struct_layout
from pipros.msg.compile.layout import INLINE_ARRAY_LIMIT, TypeLayout
from pipros.msg.language.spec import NUMBERS, OCTETS, TIMES, FieldType
from pipros.msg.time import NS_PER_S


def deserialize_body(
    layout: TypeLayout,
    names: Names,
    *,
    indent: int,
    errors: str = "strict",
    is_numpy: bool = False,
    views_octets: bool = False,
    is_plain: bool = False,
) -> list[str]:
    """Return the statements that read `self` from `str`, which is `bytes` or a `memoryview`.

    Args:
        errors: error handler for bytes in strings that are not UTF-8, as in `bytes.decode`.
        is_numpy: whether to read arrays of numbers, except octets and booleans, as numpy arrays.
        views_octets: whether to read octets as numpy arrays, unless their number is fixed.
        is_plain: whether `self` and embedded messages are dictionaries; see `reader_source`.
    """
    decoder = (_PlainDecoder if is_plain else _Decoder)(
        names, indent=indent, errors=errors, is_numpy=is_numpy, views_octets=views_octets
    )
    decoder.begin(layout)
    decoder.fields(layout, "self")
    decoder.finish(layout)
    return decoder.lines


class _Decoder(Emitter):
    def __init__(self, names: Names, *, indent: int, errors: str, is_numpy: bool, views_octets: bool) -> None:
        super().__init__(names, indent=indent)
        self._views_octets = views_octets
        self._errors = errors
        self._is_numpy = is_numpy
        self._keeps_view = False
        self._codes: list[str] = []
        self._targets: list[str] = []
        self._afterwards: list[str] = []
        self._base = ""
        self._delta = 0
        self._is_end_checked = True
        self._counts_down = False

    def begin(self, layout: TypeLayout) -> None:
        """Emit the start of the body, which converts the input if necessary.

        Slicing octets from a view avoids a copy; everything else is read faster from `bytes`.
        """
        self._keeps_view = layout.has_octets or self._is_numpy
        self.emit(
            "data = str" if self._keeps_view else "data = str if str.__class__ is _bytes else _bytes(str)"
        )

    def fields(self, layout: TypeLayout, owner: str) -> None:
        for field in layout.spec.fields:
            self._field(field.type, self._part(owner, python_name(field.name)), layout)

    def _part(self, owner: str, name: str) -> str:
        return f"{owner}.{name}"

    def _made(self, cls: str) -> str:
        """Return an expression for a new message or time, whose fields are assigned afterwards."""
        return f"_new({cls})"

    def _canonical(self, time: str) -> str:
        return f"{time}.canon()"

    def finish(self, layout: TypeLayout) -> None:
        self._flush()
        if not self._is_end_checked:
            self._check_end()
        if layout.unpaid_values or self._counts_down:
            self.lines.insert(0, f"{'    ' * self._indent}allowed = _allowed({layout.unpaid_values})")

    def _check_end(self) -> None:
        with self.block(f"if {self._offset()} > _len(data):"):
            self.emit("raise _struct.error(_TOO_SHORT)")
        self._is_end_checked = True

    def _field(self, kind: FieldType, target: str, within: TypeLayout) -> None:
        if not kind.is_array:
            self._single(kind.base, target, within)
        elif kind.base in OCTETS:
            self._octets(kind, target)
        elif kind.base in NUMBERS:
            self._number_array(kind, target)
        else:
            self._array(kind, target, within)

    def _single(self, base: str, target: str, within: TypeLayout) -> None:
        if base in NUMBERS:
            self._scalar(NUMBERS[base], target)
        elif base in TIMES:
            self._time(base, target)
        elif base == "string":
            self.emit(f"{target} = {self._text(self._slice(self._length()))}")
        else:
            message = target if target.isidentifier() else self.local("m")
            both = target if message == target else f"{message} = {target}"
            self.emit(f"{both} = {self._made(self.names.message_class(base))}")
            self.fields(within.members[base], message)

    def _text(self, octets: str) -> str:
        if self._keeps_view:
            return f'_str({octets}, "utf-8", {self._errors!r})'
        how = "" if self._errors == "strict" else f'"utf-8", {self._errors!r}'
        return f"{octets}.decode({how})"

    def _time(self, base: str, target: str) -> None:
        time = self.local("t")
        self.emit(f"{time} = {target} = {self._made(f'_{base.title()}')}")
        for code, part in zip(TIMES[base], ("secs", "nsecs"), strict=True):
            self._scalar(code, self._part(time, part))
        low = "" if base == "time" else "0 <= "
        condition = f"{low}{self._part(time, 'nsecs')} < {NS_PER_S}"
        self._afterwards += [f"if not {condition}:", f"    {self._canonical(time)}"]

    def _octets(self, kind: FieldType, target: str) -> None:
        if kind.length is not None:
            self._scalar(f"{kind.length}s", target)
            return
        if self._views_octets:
            count = self._length()
            self._flush()
            self.emit(f"{target} = _numpy_numbers(numpy, 'B', data, {self._offset()}, {count})")
            self._advance(count)
            self._is_end_checked = True
            return
        self.emit(f"{target} = _bytes({self._slice(self._length())})")

    def _number_array(self, kind: FieldType, target: str) -> None:
        code = NUMBERS[kind.base]
        is_short = kind.length is not None and kind.length <= INLINE_ARRAY_LIMIT
        is_numpy = self._is_numpy and code != "?"
        if is_short and not is_numpy:
            elements = [self.local("x") for _ in range(kind.length or 0)]
            for element in elements:
                self._scalar(code, element)
            listing = "".join(f"{element}, " for element in elements)
            self._afterwards.append(f"{target} = [{listing}]" if code == "?" else f"{target} = ({listing})")
            return
        count = self._length() if kind.length is None else str(kind.length)
        self._flush()
        if is_numpy:
            value = f"_numpy_numbers(numpy, {code!r}, data, {self._offset()}, {count})"
        else:
            value = self._numbers_at(code, count)
            value = f"_list({value})" if code == "?" else value
        self.emit(f"{target} = {value}")
        size = struct.calcsize(f"<{code}")
        self._advance(count if size == 1 else f"{count} * {size}")
        self._is_end_checked = True

    def _numbers_at(self, code: str, count: str) -> str:
        return f"_struct.unpack_from(f'<{{{count}}}{code}', data, {self._offset()})"

    def _array(self, kind: FieldType, target: str, within: TypeLayout) -> None:
        """Emit code that reads an array of strings, times or messages."""
        inner = within.members.get(kind.base)  # None if the elements are times or strings
        count = self._count(kind, inner)
        self._flush()
        if kind.base == "string":
            self._strings(count, target)
            return
        offset, array = self.assign("o", self._offset()), self.assign("a", "[]")
        self._base, self._delta = offset, 0
        if (inner is None or inner.is_one_unpack) and not self._is_numpy:
            self._records(kind.base, count, array, within)
        else:
            self._elements(kind.base, count, offset, array, within)
        self.emit(f"{target} = {array}")

    def _count(self, kind: FieldType, inner: TypeLayout | None) -> str:
        if kind.length is not None:
            return str(kind.length)
        count = self._length()
        if inner is not None and inner.unpaid_values_of_element:
            self._counts_down = True
            self.emit(f"allowed = _still_allowed(allowed, {count} * {inner.unpaid_values_of_element})")
        return count

    def _strings(self, count: str, target: str) -> None:
        arguments = f"data, {self._offset()}, {count}"
        if self.is_looping:
            value = f"_read_strings({arguments}, {self._errors!r})"
        else:
            value = f"{self.names.repeated_strings(self._errors)}({arguments})"
        end = self.local("o")
        self.emit(f"{target}, {end} = {value}")
        self._base, self._delta, self._is_end_checked = end, 0, True

    def _records(self, base: str, count: str, array: str, within: TypeLayout) -> None:
        """Emit code that reads elements of equal size with a single iterator."""
        element = self.local("e")
        with self.captured() as body:
            self._single(base, element, within)
        layout = struct_layout(self._codes)
        start = self._offset()
        self._advance(f"{count} * {struct.calcsize(layout)}")
        self._check_end()
        values = [target if target.isidentifier() else self.local("x") for target in self._targets]
        iterate = self.names.struct_method(layout, "iter_unpack")
        opening = f"for ({', '.join(values)},) in {iterate}(data[{start} : {self._offset()}]):"
        with self.loop(opening, within.spec):
            for line in body:
                self.emit(line)
            for target, value in zip(self._targets, values, strict=True):
                if target != value:
                    self.emit(f"{target} = {value}")
            for line in self._afterwards:
                self.emit(line)
            self.emit(f"{array}.append({element})")
        self._codes, self._targets, self._afterwards = [], [], []

    def _elements(self, base: str, count: str, offset: str, array: str, within: TypeLayout) -> None:
        element = self.local("e")
        was_checked = self._is_end_checked
        with self.loop(f"for _ in _range({count}):", within.spec):
            self._single(base, element, within)
            self._flush()
            self.emit(f"{array}.append({element})")
            if self._offset() != offset:
                self.emit(f"{offset} = {self._offset()}")
        self._base, self._delta = offset, 0
        self._is_end_checked = self._is_end_checked and was_checked

    def _scalar(self, code: str, target: str) -> None:
        self._codes.append(code)
        self._targets.append(target)

    def _length(self) -> str:
        """Emit code that reads a length, and return the local name of the length."""
        length = self.local("n")
        self._scalar("I", length)
        self._flush()
        return length

    def _flush(self) -> None:
        """Emit code that unpacks the scalars collected so far."""
        if self._codes:
            layout = struct_layout(self._codes)
            unpack = self.names.struct_method(layout, "unpack_from")
            arguments = f"data, {self._offset()}"
            self.emit(f"({', '.join(self._targets)},) = {unpack}({arguments})")
            self._delta += struct.calcsize(layout)
            self._is_end_checked = True
        for line in self._afterwards:
            self.emit(line)
        self._codes, self._targets, self._afterwards = [], [], []

    def _offset(self) -> str:
        if not self._base:
            return str(self._delta)
        return f"{self._base} + {self._delta}" if self._delta else self._base

    def _slice(self, length: str) -> str:
        """Return an expression for the next `length` bytes, and move the offset to their end."""
        start, end = self._offset(), self.local("o")
        self._base, self._delta, self._is_end_checked = end, 0, False
        return f"data[{start} : ({end} := {start} + {length})]"

    def _advance(self, size: str) -> None:
        self._base = self.assign("o", f"{self._offset()} + {size}")
        self._delta = 0


class _PlainDecoder(_Decoder):
    """Emits code that reads dictionaries instead of messages."""

    def _part(self, owner: str, name: str) -> str:
        return f"{owner}[{name!r}]"

    def _made(self, cls: str) -> str:  # noqa: ARG002
        return "{}"

    def _canonical(self, time: str) -> str:
        return f"_canonical({time})"

    def _octets(self, kind: FieldType, target: str) -> None:
        super()._octets(kind, target)
        self._afterwards.append(f"{target} = _base64({target})")

    def _numbers_at(self, code: str, count: str) -> str:
        return f"_plain_numbers({code!r}, data, {self._offset()}, {count})"
