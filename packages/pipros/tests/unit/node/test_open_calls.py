"""Groups of calls that can be interrupted."""

from __future__ import annotations

import threading
import weakref

from pipros.node.open_calls import OpenCalls


class Call:
    interrupted = 0

    def interrupt(self) -> None:
        self.interrupted += 1

    interrupt_present = interrupt


def test_a_finalizer_may_remove_a_call_while_calls_are_listed() -> None:
    """A link's finalizer once waited for a lock that its own thread held, so a node never ended."""
    calls, other = OpenCalls(), Call()
    held: list[Call] = []

    class Dying(Call):
        @property  # type: ignore[misc]
        def __class__(self) -> type:
            held.clear()  # then, whoever asked for the class has the last reference
            return Call

    held += [Dying(), Dying()]
    for call in (*held, other):
        calls.add(call)
    weakref.finalize(held[0], calls.remove, other)
    del call
    thread = threading.Thread(target=calls.interrupt, args=(1e-3,), daemon=True)
    thread.start()
    thread.join(30)
    assert not thread.is_alive()
    assert not other.interrupted


def test_all_calls_of_a_group_and_its_parts_are_interrupted_and_later_ones_too() -> None:
    calls = OpenCalls()
    part = OpenCalls(part_of=calls)
    first, removed, of_part, late = Call(), Call(), Call(), Call()
    for call in (first, removed):
        calls.add(call)
    part.add(of_part)
    calls.remove(removed)
    calls.interrupt()
    part.add(late)
    assert [call.interrupted for call in (first, removed, of_part, late)] == [1, 0, 1, 1]
