"""Emit code that reads a source and writes a target, one of which is CDR.

`RunEmitter` keeps a cursor in each. Items that are copied, dropped or filled are collected in a run, which
is converted by a single statement that `flush` emits.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipros.msg.compile.emitter import Emitter, Names
from pipros_rosbag2.conversion.runs import PHASES, TESTS, Check, Layout, RunItem, RunRole, layout


@dataclass(frozen=True, slots=True)
class Cursor:
    """An offset: `delta` plus the local variable `base`, if any, whose value is a multiple of `unit`."""

    base: str = ""
    delta: int = 0
    unit: int = PHASES

    def __str__(self) -> str:
        if not self.base:
            return str(self.delta)
        return f"{self.base} + {self.delta}" if self.delta else self.base

    def plus(self, count: int) -> Cursor:
        return Cursor(self.base, self.delta + count, self.unit)

    def remainder(self, unit: int) -> int | None:
        """Return the offset modulo `unit`, or None if it is unknown."""
        return self.delta % unit if self.unit % unit == 0 else None


class RunEmitter(Emitter):
    """Emits the statements of a function that reads `data`, a memoryview, and passes parts to `add`.

    Attributes:
        tables: values that the function needs, by name.
        items: the current run.
        source, target: the offsets after the last run. `target` is unused if the target is ROS 1.
    """

    def __init__(self, *, to_cdr: bool) -> None:
        super().__init__(Names(), indent=1)
        self.tables: dict[str, Any] = {}
        self.to_cdr = to_cdr
        self.items: list[RunItem] = []
        self.source = Cursor()
        self.target = Cursor()

    def slice(self, size: str, ahead: int) -> tuple[str, str]:
        """Skip `ahead` bytes of the source, then a slice of `size` bytes.

        Return expressions for the start and the end of the slice.
        """
        start = str(self.source.plus(ahead))
        end = self.assign("o", f"{start} + {size}")
        self.source = Cursor(end, 0, 1)
        return start, end

    def align_source(self, unit: int) -> None:
        rest = self.source.remainder(unit)
        if rest is not None:
            self.source = self.source.plus(-rest % unit)
        else:
            self.source = Cursor(self.assign("o", f"({self.source} + {unit - 1}) & {-unit}"), 0, unit)

    def align_target(self, unit: int) -> None:
        rest = self.target.remainder(unit)
        if rest is None:
            name = self.assign("w", str(self.target))
            self.emit(f"if {name} & {unit - 1}: add(_pads[-{name} & {unit - 1}])")
            self.target = Cursor(self.assign("w", f"({name} + {unit - 1}) & {-unit}"), 0, unit)
        elif rest:
            self.emit(f"add(_pads[{unit - rest}])")
            self.target = self.target.plus(unit - rest)

    def align_elements(self, count: str) -> None:
        """Emit code that aligns a sequence's elements to 8 bytes. An empty sequence has no padding."""
        cursor = self.target if self.to_cdr else self.source
        name = self.assign("w" if self.to_cdr else "o", str(cursor))
        with self.block(f"if {count} and {name} & 7:"):
            if self.to_cdr:
                self.emit(f"add(_pads[8 - ({name} & 7)])")
            self.emit(f"{name} = ({name} + 7) & -8")
        if self.to_cdr:
            self.target = Cursor(name, 0, 4)
        else:
            self.source = Cursor(name, 0, 4)

    def write_length(self, expression: str) -> None:
        rest = self.target.remainder(4)
        if rest is not None:
            self.emit(f"add(_lengths[{rest}]({expression}))")
            self.target = self.target.plus(4 + -rest % 4)
            return
        name = self.assign("w", str(self.target))
        self.emit(f"add(_lengths[{name} & 3]({expression}))")
        self.target = Cursor(self.assign("w", f"({name} + 7) & -4"), 0, 4)

    def target_local(self, expression: str, unit: int = 1) -> Cursor:
        return Cursor(self.assign("w", expression), 0, unit)

    def flush(self) -> None:
        """Emit code that converts the run collected so far."""
        items = [item for item in self.items if item.size]
        self.items = []
        if not items:
            return
        cursor = self.target if self.to_cdr else self.source
        unit = max((item.alignment for item in items if _is_in_cdr(item, to_cdr=self.to_cdr)), default=1)
        phase = cursor.remainder(unit)
        if phase is None:
            self._flush_dynamic(items, unit, cursor)
            return
        made = layout(items, phase, to_cdr=self.to_cdr)
        for check, offset in made.checked:
            self._check_value(check, str(self.source.plus(offset)))
        self._add_run(made, items, str(self.source))
        self.source = self.source.plus(made.source_size)
        self.target = self.target.plus(made.target_size)

    def _add_run(self, made: Layout, items: Sequence[RunItem], source: str) -> None:
        if made.is_plain:
            self.emit(f"add({self.table('_unpack', made.unpack)}(data, {source})[0])")
        elif any(item.role is RunRole.COPY for item in items):
            unpack, pack = self.table("_unpack", made.unpack), self.table("_pack", made.pack)
            self.emit(f"add({pack}(*{unpack}(data, {source})))")
        elif made.target_size:
            self.emit(f"add({self.table('_fill', made.pack())})")

    def _flush_dynamic(self, items: Sequence[RunItem], unit: int, cursor: Cursor) -> None:
        layouts = [layout(items, phase, to_cdr=self.to_cdr) for phase in range(unit)]
        start = self.assign("w" if self.to_cdr else "o", str(cursor))
        phase = self.assign("p", f"{start} & {unit - 1}")
        for number, (check, offset) in enumerate(layouts[0].checked):
            if self.to_cdr:
                place = str(self.source.plus(offset))
            else:
                offsets = tuple(each.checked[number][1] for each in layouts)
                place = f"{start} + {self.table('_at', offsets)}[{phase}]"
            self._check_value(check, place)
        source = str(self.source) if self.to_cdr else start
        if any(item.role is RunRole.COPY for item in items):
            unpack = self.table("_unpack", tuple(each.unpack for each in layouts))
            pack = self.table("_pack", tuple(each.pack for each in layouts))
            self.emit(f"add({pack}[{phase}](*{unpack}[{phase}](data, {source})))")
        elif layouts[0].target_size:
            self.emit(f"add({self.table('_fill', tuple(each.pack() for each in layouts))}[{phase}])")
        if self.to_cdr:
            sizes = self.table("_size", tuple(each.target_size for each in layouts))
            self.source = self.source.plus(layouts[0].source_size)
            self.target = self._after(items, unit, f"{start} + {sizes}[{phase}]")
        else:
            sizes = self.table("_size", tuple(each.source_size for each in layouts))
            self.source = self._after(items, unit, f"{start} + {sizes}[{phase}]")

    def _after(self, items: Sequence[RunItem], unit: int, end: str) -> Cursor:
        """Return the CDR cursor after a run, relative to the run's last item with the largest alignment."""
        tail = 0
        present = [item for item in items if _is_in_cdr(item, to_cdr=self.to_cdr)]
        for number, item in enumerate(present):
            if item.alignment == unit:
                rest = present[number:]
                tail = layout(
                    [RunItem(RunRole.COPY, e.size, e.alignment) for e in rest], 0, to_cdr=True
                ).target_size
        return Cursor(self.assign("w" if self.to_cdr else "o", f"{end} - {tail}"), tail, unit)

    def _check_value(self, check: Check, place: str) -> None:
        at, test = TESTS[check]
        self.emit(
            f"if data[{place} + {at}] {test}: data = _patched(data, {place}, {self.table('_check', check)})"
        )

    def table(self, prefix: str, content: Any) -> str:
        for name, known in self.tables.items():
            if name.startswith(prefix) and known == content:
                return name
        name = f"{prefix}{len(self.tables)}"
        self.tables[name] = content
        return name


def _is_in_cdr(item: RunItem, *, to_cdr: bool) -> bool:
    return item.role is RunRole.COPY or (item.role is RunRole.FILL) == to_cdr


LENGTHS = tuple(struct.Struct(f"<{-phase % 4}xI").pack for phase in range(4))
"""Functions that encode a length after its padding, by the offset modulo 4."""

PADS = tuple(bytes(count) for count in range(PHASES))
