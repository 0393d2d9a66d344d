"""Generate the function that converts one message type from ROS 1 to CDR, or from CDR to ROS 1.

Theory of operation:

- The function reads `data` once, from start to end, and adds parts to a list. It creates no message objects.
- Numbers, times and fixed arrays of numbers are collected in a run (`runs.py`), which is converted by one
  `unpack_from` and one `pack`. If the offset in CDR is known modulo 8, the generator chooses the layout;
  otherwise, the function chooses it at run time.
- Arrays of numbers, and arrays of messages without padding (for example, points), are copied as slices of
  `data`.
- Only arrays of other elements become loops.
- A slice that exceeds the data is detected by the next `unpack_from`, or by the check at the end.
- If corresponding fields are in a different order in the two definitions, an additional first pass over the
  message finds their offsets.

The generated source contains no text from definitions; it refers to tables by numbered names.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipros.basics.limits import Limits
from pipros.msg.language.spec import MessageSpec
from pipros_rosbag2.conversion.errors import NotConvertible
from pipros_rosbag2.conversion.one_sided import OneSidedEmitter, one_of
from pipros_rosbag2.conversion.pairing import Pair, Pairing, Path
from pipros_rosbag2.conversion.run_emitter import Cursor
from pipros_rosbag2.conversion.runs import Check, RunItem, RunRole, layout
from pipros_rosbag2.conversion.values import Value, ValueKind, Values
from pipros_rosbag2.interfaces.spec import Form, Ros2Message

HEADER = b"\0\1\0\0"
"""The encapsulation header of little-endian CDR (XCDR1)."""

_SINGLE_CHECKS = {
    (ValueKind.TIME, True): Check.TIME_TO_ROS2,
    (ValueKind.TIME, False): Check.TIME_TO_ROS1,
    (ValueKind.DURATION, True): Check.DURATION_TO_ROS2,
    (ValueKind.DURATION, False): Check.DURATION_TO_ROS1,
}
_LOG = ("rosgraph_msgs/Log", "rcl_interfaces/msg/Log")


def converter_source(
    pair: Pair, pairing: Pairing, limits: Limits, *, to_cdr: bool
) -> tuple[str, dict[str, Any]]:
    """Return the source of a module with the function `convert(data)`, and the tables that it needs.

    The function takes a `memoryview` of a ROS 1 message or of a CDR body, and returns a list of buffers.

    Raises:
        NotConvertible: corresponding fields have incompatible types.
        DefinitionError: the types exceed a limit.
    """
    made = _Converter(pair, pairing, limits, to_cdr=to_cdr)
    made.whole(pair)
    lines = ["def convert(data):", *made.lines]
    return "\n".join((*lines, "")), made.tables


class _Converter(OneSidedEmitter):
    def __init__(self, pair: Pair, pairing: Pairing, limits: Limits, *, to_cdr: bool) -> None:
        super().__init__(pair, Values(pairing.lookup, pairing.catalog), limits, to_cdr=to_cdr)
        self._pairing = pairing
        self._flat: dict[str, bool] = {}

    def whole(self, pair: Pair) -> None:
        self.emit("parts = [_header]" if self.to_cdr else "parts = []")
        self.emit("add = parts.append")
        first, second = self.values.of_message(pair.ros1), self.values.of_message(pair.ros2)
        if first.kind is not ValueKind.MESSAGE and first.kind is second.kind:
            self._single(*self._ordered(first, second))
        else:
            self._linked(pair)
        self.flush()
        self.emit(f"_check_end({self.source}, _len(data))")
        self.emit("return parts")

    def _ordered(self, ros1: Value, ros2: Value) -> tuple[Value, Value]:
        """Return the values in the order source, target."""
        return (ros1, ros2) if self.to_cdr else (ros2, ros1)

    # Messages ---------------------------------------------------------------------------------------------

    def _linked(self, pair: Pair) -> None:
        ros1, ros2 = self.values.of_fields(pair.ros1), self.values.of_fields(pair.ros2)
        source, target = self._ordered_fields(ros1, ros2)
        links = {
            (link.ros2 if self.to_cdr else link.ros1): (link.ros1 if self.to_cdr else link.ros2)
            for link in pair.links
        }
        names = list(source)
        simple = all(len(path) == 1 for link in links.items() for path in link)
        if simple:
            places = [names.index(links[(name,)][0]) for name in target if (name,) in links]
            simple = places == sorted(places)
        if simple:
            self._in_order(source, target, {to[0]: of[0] for to, of in links.items()}, pair)
        else:
            self._anywhere(source, target, links, pair)

    def _ordered_fields(
        self, ros1: dict[str, Value], ros2: dict[str, Value]
    ) -> tuple[dict[str, Value], dict[str, Value]]:
        return (ros1, ros2) if self.to_cdr else (ros2, ros1)

    def _in_order(
        self, source: Mapping[str, Value], target: Mapping[str, Value], links: Mapping[str, str], pair: Pair
    ) -> None:
        left = list(source)
        for name, value in target.items():
            if name not in links:
                self.fill(value, pair)
                continue
            while left[0] != links[name]:
                self.skip(source[left.pop(0)])
            self._field(source[left.pop(0)], value, f"{pair.ros1.type}.{name}")
        for name in left:
            self.skip(source[name])

    def _anywhere(
        self, source: Mapping[str, Value], target: Mapping[str, Value], links: Mapping[Path, Path], pair: Pair
    ) -> None:
        self.flush()
        found: dict[Path, tuple[Cursor, Value]] = {}
        self._locate(source, (), set(links.values()), found)
        self.flush()
        end = self.source
        missing = sorted(".".join(path) for path in set(links.values()) - found.keys())
        if missing:
            raise _no_field(pair, missing[0])
        used: set[Path] = set()
        self._fill_tree(target, (), links, found, used, pair)
        unused = sorted(".".join(path) for path in links.keys() - used)
        if unused:
            raise _no_field(pair, unused[0])
        self.flush()
        self.source = end

    def _locate(
        self,
        fields: Mapping[str, Value],
        above: Path,
        wanted: set[Path],
        found: dict[Path, tuple[Cursor, Value]],
    ) -> None:
        """Emit code that skips fields, and collect the offsets of the wanted fields."""
        for name, value in fields.items():
            path = (*above, name)
            if path in wanted:
                self.flush()
                found[path] = self.source, value
            is_above = any(len(each) > len(path) and each[: len(path)] == path for each in wanted)
            if is_above and value.form is Form.SINGLE and value.message is not None:
                self._locate(self.values.of_fields(value.message), path, wanted, found)
            else:
                self.skip(value)

    def _fill_tree(
        self,
        fields: Mapping[str, Value],
        above: Path,
        links: Mapping[Path, Path],
        found: Mapping[Path, tuple[Cursor, Value]],
        used: set[Path],
        pair: Pair,
    ) -> None:
        for name, value in fields.items():
            path = (*above, name)
            if path in links:
                self.flush()
                used.add(path)
                self.source, source = found[links[path]]
                if _is_log(pair) and name == "level":
                    check = Check.LEVEL_TO_ROS2 if self.to_cdr else Check.LEVEL_TO_ROS1
                    self.items.append(RunItem(RunRole.COPY, 1, 1, check))
                else:
                    self._field(source, value, f"{pair.ros1.type}.{name}")
                self.flush()
            elif any(each[: len(path)] == path for each in links) and value.message is not None:
                self._fill_tree(self.values.of_fields(value.message), path, links, found, used, pair)
            else:
                self.fill(value, pair)

    # Fields -----------------------------------------------------------------------------------------------

    def _field(self, source: Value, target: Value, where: str) -> None:
        self.count_field(where)
        if source.form is not target.form or source.length != target.length or source.kind is not target.kind:
            raise NotConvertible(f"{where}: {_described(source)} and {_described(target)} do not correspond")
        if source.kind is ValueKind.WIDE_STRING:
            raise NotConvertible(f"{where}: wide strings have no counterpart in ROS 1")
        if source.size != target.size:
            raise NotConvertible(
                f"{where}: numbers of {source.size} and {target.size} bytes do not correspond"
            )
        if source.form is Form.SINGLE:
            self._single(source, target)
        elif source.kind in (ValueKind.INTEGER, ValueKind.FLOAT) and source.form is Form.ARRAY:
            self.items.append(RunItem(RunRole.COPY, source.size * source.length, source.size))
        else:
            self._array(source, target)

    def _single(self, source: Value, target: Value) -> None:
        if source.kind is ValueKind.STRING:
            self._string(target.string_bound)
        elif source.kind is ValueKind.MESSAGE:
            self._linked(self._pair(source, target))
        else:
            check = _SINGLE_CHECKS.get((source.kind, self.to_cdr))
            self.items.append(RunItem(RunRole.COPY, source.size, source.alignment, check))

    def _pair(self, source: Value, target: Value) -> Pair:
        first, second = self._ordered(source, target)
        if not isinstance(first.message, MessageSpec) or not isinstance(second.message, Ros2Message):
            raise TypeError("a message must have a definition")
        return self._pairing.message(first.message, second.message)

    def _string(self, bound: int) -> None:
        self.flush()
        length = self.local("n")
        if self.to_cdr:
            self.emit(f"({length},) = _u32(data, {self.source})")
            if bound:
                self.emit(f"if {length} > {bound}: _raise_bound({length}, {bound})")
            self.write_length(f"{length} + 1")
            start, end = self.slice(length, 4)
            self.emit(f"add(data[{start} : {end}])")
            self.emit("add(_nul)")
            self.target = self.target_local(f"{self.target.plus(1)} + {length}")
            return
        self.align_source(4)
        self.emit(f"({length},) = _u32(data, {self.source})")
        start, end = self.slice(length, 4)
        with self.block(f"if {length}:"):
            self.emit(f"{length} -= 1")
            self.emit(f"if data[{end} - 1]: _raise_unterminated()")
        self.emit(f"add(_p32({length}))")
        self.emit(f"add(data[{start} : {start} + {length}])")

    def _array(self, source: Value, target: Value) -> None:
        """Emit code that converts a sequence, or a fixed array of anything but numbers."""
        self.flush()
        count = self._copied_count(source, target)
        element = self._flat_element(source, target)
        if element is not None:
            size, alignment = element
            if source.form is Form.ARRAY:
                (self.align_target if self.to_cdr else self.align_source)(alignment)
            elif alignment == 8:
                self.align_elements(count)
            start, end = self.slice(count if size == 1 else f"{count} * {size}", 0)
            self.emit(f"add(data[{start} : {end}])")
            if self.to_cdr:
                units = (u for u in (8, 4, 2) if size % u == 0 and self.target.remainder(u) == 0)
                self.target = self.target_local(f"{self.target} + {end} - ({start})", next(units, 1))
            return
        self.check_left(count, source)
        self.repeat(count, lambda: self._single(one_of(source), one_of(target)))

    def _copied_count(self, source: Value, target: Value) -> str:
        if source.form is Form.ARRAY:
            return str(source.length)
        if not self.to_cdr:
            self.align_source(4)
        count = self.local("n")
        self.emit(f"({count},) = _u32(data, {self.source})")
        self.source = self.source.plus(4)
        if target.bound:
            self.emit(f"if {count} > {target.bound}: _raise_bound({count}, {target.bound})")
        if self.to_cdr:
            self.write_length(count)
        else:
            self.emit(f"add(_p32({count}))")
        return count

    def _flat_element(self, source: Value, target: Value) -> tuple[int, int] | None:
        """Return an element's size and alignment.

        Return None unless the element's bytes are the same on both sides, without padding.
        """
        if source.kind in (ValueKind.INTEGER, ValueKind.FLOAT):
            return source.size, source.size
        if not self._may_be_flat(one_of(source)):
            return None
        before = self.lines, self.items, self.source, self.target
        self.lines, self.items = [], []
        self.source = self.target = Cursor()
        self._linked(self._pair(source, target))
        emitted, items = self.lines, self.items
        self.lines, self.items, self.source, self.target = before
        alignment = max((item.alignment for item in items), default=0)
        is_plain = (
            items and not emitted and all(item.role is RunRole.COPY and item.check is None for item in items)
        )
        if not is_plain or items[0].alignment != alignment:
            return None
        made = layout(items, 0, to_cdr=self.to_cdr)
        if not made.is_plain or made.source_size != made.target_size or made.source_size % alignment:
            return None
        return made.source_size, alignment

    def _may_be_flat(self, value: Value) -> bool:
        """Return False for a type that contains strings, times, or arrays other than fixed arrays of numbers.

        For those types, `_flat_element` always fails, and its attempts would multiply with the nesting depth.
        """
        if value.kind is not ValueKind.MESSAGE or value.message is None:
            return value.kind in (ValueKind.INTEGER, ValueKind.FLOAT) and value.form is not Form.SEQUENCE
        if value.form is not Form.SINGLE:
            return False
        name = value.message.type
        if name not in self._flat:
            fields = self.values.of_fields(value.message).values()
            self._flat[name] = all(self._may_be_flat(each) for each in fields)
        return self._flat[name]


def _is_log(pair: Pair) -> bool:
    return (pair.ros1.type, pair.ros2.type) == _LOG


def _no_field(pair: Pair, name: str) -> NotConvertible:
    return NotConvertible(f"a rule for {pair.ros1.type} names the field {name}, which does not exist")


def _described(value: Value) -> str:
    if value.form is Form.SINGLE:
        return f"one {value.kind.value.removesuffix('s')}"
    many = f"an array of {value.length}" if value.form is Form.ARRAY else "a sequence of"
    return f"{many} {value.kind.value}"
