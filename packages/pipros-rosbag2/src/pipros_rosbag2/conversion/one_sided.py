"""Emit code for fields that one side of a conversion lacks, and for the loops over elements."""

from __future__ import annotations

from collections.abc import Callable

from pipros.basics.limits import Limits, limit_text
from pipros.msg.compile.arrays import EMPTY_ELEMENTS
from pipros.msg.compile.layout import MESSAGE_VALUES
from pipros.msg.language.spec import DefinitionError, MessageSpec
from pipros_rosbag2.conversion.defaults import default_bytes
from pipros_rosbag2.conversion.errors import NotConvertible
from pipros_rosbag2.conversion.pairing import Pair
from pipros_rosbag2.conversion.run_emitter import Cursor, RunEmitter
from pipros_rosbag2.conversion.runs import RunItem, RunRole
from pipros_rosbag2.conversion.values import Value, ValueKind, Values
from pipros_rosbag2.interfaces.cdr import WIDE_BYTES
from pipros_rosbag2.interfaces.spec import Form


class OneSidedEmitter(RunEmitter):
    """Emits code that skips fields of the source, and code that writes default values.

    Args:
        pair: the messages that are converted.
        limits: the total number of fields of the message, with those of embedded messages, is limited.

    Attributes:
        values: converter of field types.
    """

    def __init__(self, pair: Pair, values: Values, limits: Limits, *, to_cdr: bool) -> None:
        super().__init__(to_cdr=to_cdr)
        self.values = values
        self._limits = limits
        self._fields = 0
        self._outer = pair.ros1.type
        self._smallest: dict[str, int] = {}

    def skip(self, value: Value) -> None:
        """Emit code that skips a field that the target lacks."""
        self.count_field(self._outer)
        is_number = value.kind in (ValueKind.INTEGER, ValueKind.FLOAT)
        if value.form is Form.SINGLE:
            self._skip_single(value)
        elif is_number and value.form is Form.ARRAY:
            self.items.append(RunItem(RunRole.DROP, value.size * value.length, value.size))
        else:
            self.flush()
            count = str(value.length)
            if value.form is Form.SEQUENCE:
                count = self._read_length()
            if is_number:
                if not self.to_cdr and value.size == 8:
                    self.align_elements(count)
                self.slice(f"{count} * {value.size}", 0)
                return
            self.check_left(count, value)
            target = self.target
            self.repeat(count, lambda: self._skip_single(one_of(value)))
            self.target = target

    def _skip_single(self, value: Value) -> None:
        if value.kind in (ValueKind.STRING, ValueKind.WIDE_STRING):
            self.flush()
            unit = WIDE_BYTES if value.kind is ValueKind.WIDE_STRING else 1
            self.slice(f"{self._read_length()} * {unit}", 0)
        elif value.kind is ValueKind.MESSAGE and value.message is not None:
            for field in self.values.of_fields(value.message).values():
                self.skip(field)
        else:
            self.items.append(RunItem(RunRole.DROP, value.size, value.alignment))

    def _read_length(self) -> str:
        if not self.to_cdr:
            self.align_source(4)
        length = self.local("n")
        self.emit(f"({length},) = _u32(data, {self.source})")
        self.source = self.source.plus(4)
        return length

    def fill(self, value: Value, pair: Pair) -> None:
        """Emit code that writes the default value of a field that the source lacks."""
        self.count_field(self._outer)
        count = value.length if value.form is Form.ARRAY else 1
        if count * max(1, value.size) > MESSAGE_VALUES:
            raise NotConvertible(
                f"{pair.ros2.type}: a default value has {count} elements of {value.size} bytes; "
                f"the limit is {MESSAGE_VALUES}"
            )
        for size, alignment, octets in default_bytes(value, self.values, to_cdr=self.to_cdr):
            self.count_field(pair.ros2.type)
            if not octets.strip(b"\0"):
                self.items.append(RunItem(RunRole.FILL, size, alignment))
                continue
            self.flush()
            if self.to_cdr:
                self.align_target(alignment)
                self.target = self.target.plus(size)
            self.emit(f"add({self.table('_fill', octets)})")

    def repeat(self, count: str, body: Callable[[], None]) -> None:
        """Emit a loop whose cursors are local variables."""
        self.flush()
        source = self.assign("o", str(self.source))
        target = self.assign("w", str(self.target)) if self.to_cdr else ""
        self.source, self.target = Cursor(source, 0, 1), Cursor(target, 0, 1)
        with self.loop(f"for _ in _range({count}):", _place(self._outer)):
            body()
            self.flush()
            for name, cursor in ((source, self.source), (target, self.target)):
                if name and str(cursor) != name:
                    self.emit(f"{name} = {cursor}")
            self.emit("pass")
        self.source, self.target = Cursor(source, 0, 1), Cursor(target, 0, 1)

    def count_field(self, where: str) -> None:
        self._fields += 1
        if self._fields > self._limits.definition_fields:
            limit = limit_text("definition_fields", self._limits.definition_fields)
            raise DefinitionError(f"the message has too many fields in total; {limit}", file=where)

    def check_left(self, count: str, source: Value) -> None:
        smallest = self._smallest_size(one_of(source))
        left = f"_len(data) - ({self.source})"
        self.emit(f"_check_count({count}, {smallest}, {left}, {EMPTY_ELEMENTS})")

    def _smallest_size(self, value: Value) -> int:
        """Return a lower bound for the size of a value in the source, in bytes."""
        if value.form is Form.SEQUENCE or (value.form is Form.SINGLE and value.kind is ValueKind.STRING):
            return 4
        if value.form is Form.ARRAY:
            return value.length * self._smallest_size(one_of(value))
        if value.kind is not ValueKind.MESSAGE or value.message is None:
            return value.size or 4
        name = value.message.type
        if name not in self._smallest:
            fields = self.values.of_fields(value.message).values()
            self._smallest[name] = sum(self._smallest_size(each) for each in fields)
        return self._smallest[name]


def one_of(value: Value) -> Value:
    """Return the type of one element of a field."""
    return Value(value.kind, Form.SINGLE, 0, value.size, value.message, 0, value.string_bound)


def _place(type_name: str) -> MessageSpec:
    return MessageSpec(type_name, (), (), "", type_name)
