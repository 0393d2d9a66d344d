"""Fragments of one sample: joined, and counted in the budget until they are released."""

from __future__ import annotations

from pipros.basics.budget import Budget
from pipros_ros2.rtps.incomplete import PIECE_OVERHEAD_BYTES, Assembly, inline_bytes
from pipros_ros2.rtps.parameters import Parameters
from pipros_ros2.rtps.submessages import DataFrag

READER, WRITER = b"\0\0\1\4", b"\0\0\1\3"
HASH: Parameters = {0x70: [b"key hash of 16 b"]}
SIZE, COUNT = 1000, 3


def fragment(which: int, inline: Parameters | None = None) -> DataFrag:
    """One of three fragments of a sample."""
    return DataFrag(READER, WRITER, 1, which, 1, SIZE, COUNT * SIZE, inline, bytes([which]) * SIZE)


def started(budget: Budget) -> Assembly:
    made = Assembly.start(budget, fragment(1), 100.0)
    assert made is not None
    return made


def test_fragments_are_joined_in_any_order_with_the_first_inline_values() -> None:
    budget = Budget(100_000)
    assembly = started(budget)
    other: Parameters = {0x70: [b"a later key hash"]}
    assert assembly.add(fragment(3, HASH), 101.0) is None
    assert assembly.add(fragment(1, other), 102.0) is None

    assert assembly.add(fragment(2), 103.0) == b"".join(bytes([which]) * SIZE for which in (1, 2, 3))
    assert (assembly.inline, assembly.changed_at) == (HASH, 103.0)
    assert budget.used >= COUNT * (SIZE + PIECE_OVERHEAD_BYTES) + inline_bytes(HASH)
    assembly.release()
    assert budget.used == 0


def test_inline_values_beyond_the_budget_are_left_out() -> None:
    budget = Budget(10_000)
    assembly = started(budget)
    assembly.add(fragment(1, {0x70: [bytes(20_000)]}), 101.0)

    assert assembly.inline is None
    assert assembly.missing() == (2, 3)


def test_a_fragment_beyond_the_budget_is_dropped_and_remains_missing() -> None:
    budget = Budget(10_000)
    assembly = started(budget)
    assembly.add(fragment(1), 101.0)
    others = budget.left
    budget.take(others)
    for which in (2, 3):
        assert assembly.add(fragment(which), 102.0) is None
    assert 3 in assembly.missing()

    budget.give_back(others)
    for which in assembly.missing():
        complete = assembly.add(fragment(which), 103.0)
    assert complete == b"".join(bytes([which]) * SIZE for which in (1, 2, 3))


def test_no_assembly_starts_without_budget() -> None:
    assert Assembly.start(Budget(PIECE_OVERHEAD_BYTES - 1), fragment(1), 100.0) is None
