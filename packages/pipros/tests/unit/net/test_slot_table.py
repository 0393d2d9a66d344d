"""Slots are never given to two messages, never lost, and one subscriber never takes those of others."""

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, invariant, precondition, rule

from pipros.basics.errors import ProtocolError
from pipros.net.slot_table import QUOTA, SLOTS, SlotTable
from pipros.wire.slot_frames import Slot


class Slots(RuleBasedStateMachine):
    """Compares a table with the sets of its holders."""

    subscribers = Bundle("subscribers")

    def __init__(self) -> None:
        super().__init__()
        self.table = SlotTable()
        self.segment = 0
        self.sizes: dict[int, int] = {}
        self.queue_sizes: dict[str, int] = {}
        self.next_name = 0
        self.waiting: dict[str, set[Slot]] = {}
        self.in_use: dict[str, set[Slot]] = {}
        self.add_segment(SLOTS)

    @rule(slots=st.integers(2, SLOTS))
    def add_segment(self, slots: int) -> None:
        self.segment += 1
        self.sizes[self.segment] = slots
        self.table.add_segment(self.segment, slots)

    @rule(target=subscribers, queue_size=st.integers(0, 10))
    def join(self, queue_size: int) -> str:
        self.next_name += 1
        name = f"subscriber {self.next_name}"
        self.table.add_subscriber(name)
        self.queue_sizes[name] = queue_size
        self.waiting[name], self.in_use[name] = set(), set()
        return name

    @rule(name=consumes(subscribers))
    def leave(self, name: str) -> None:
        self.table.remove_subscriber(name)
        self.table.remove_subscriber(name)
        del self.waiting[name], self.in_use[name]

    @rule(names=st.sets(subscribers), is_sent=st.booleans())
    def publish(self, names: set[str], is_sent: bool) -> None:
        slot = self.table.take(self.segment)
        taken = {
            held for holders in (self.waiting, self.in_use) for slots in holders.values() for held in slots
        }
        is_full = len([held for held in taken if held[0] == self.segment]) == self.sizes[self.segment]
        assert (slot is None) == is_full
        if slot is None:
            return
        assert slot not in taken
        for name in names & self.waiting.keys():
            if self.table.has_free_slot(name, self.queue_sizes[name]):
                self.table.give(name, slot)
                self.waiting[name].add(slot)
                if not is_sent:
                    self.table.take_back(name, slot)
                    self.waiting[name].remove(slot)
        self.table.release(slot)

    @rule(name=subscribers, data=st.data())
    def use(self, name: str, data: st.DataObject) -> None:
        if self.waiting[name]:
            slot = data.draw(st.sampled_from(sorted(self.waiting[name])))
            self.table.acknowledge(name, slot, in_use=True)
            self.waiting[name].remove(slot)
            self.in_use[name].add(slot)

    @rule(name=subscribers, data=st.data())
    def give_back(self, name: str, data: st.DataObject) -> None:
        if held := self.waiting[name] | self.in_use[name]:
            slot = data.draw(st.sampled_from(sorted(held)))
            self.table.acknowledge(name, slot, in_use=False)
            self.waiting[name].discard(slot)
            self.in_use[name].discard(slot)

    @rule(name=subscribers, slot=st.tuples(st.integers(0, 3), st.integers(0, SLOTS)), in_use=st.booleans())
    def lie(self, name: str, slot: Slot, in_use: bool) -> None:
        may = self.waiting[name] if in_use else self.waiting[name] | self.in_use[name]
        if slot not in may:
            with pytest.raises(ProtocolError, match="does not hold"):
                self.table.acknowledge(name, slot, in_use=in_use)

    @precondition(lambda self: len(self.sizes) > 1)
    @rule()
    def remove_unused(self) -> None:
        for segment in [number for number in self.sizes if number != self.segment]:
            if self.table.is_unused(segment):
                self.table.remove_segment(segment)
                del self.sizes[segment]

    @invariant()
    def nobody_holds_more_than_its_quota(self) -> None:
        for name in self.waiting:
            most = max(QUOTA, self.queue_sizes[name])
            assert self.table.waiting(name) == len(self.waiting[name]) <= most
            assert self.table.has_slots(name) == bool(self.waiting[name] or self.in_use[name])

    @invariant()
    def unused_segments_have_no_holders(self) -> None:
        held = {
            slot[0] for holders in (self.waiting, self.in_use) for slots in holders.values() for slot in slots
        }
        for segment in self.sizes:
            assert self.table.is_unused(segment) == (segment not in held)


TestSlots = Slots.TestCase


def test_a_subscriber_with_a_full_quota_leaves_slots_for_others() -> None:
    table = SlotTable()
    table.add_segment(1, SLOTS)
    for name in ("stuck", "good"):
        table.add_subscriber(name)
    given = []
    for _ in range(3 * SLOTS):
        slot = table.take(1)
        assert slot is not None
        for name in ("stuck", "good"):
            if table.has_free_slot(name):
                table.give(name, slot)
                given.append(name)
        table.release(slot)
        table.acknowledge("good", slot, in_use=False)
    assert (given.count("stuck"), given.count("good")) == (QUOTA, 3 * SLOTS)


def test_subscribers_with_long_queues_that_hang_one_after_the_other_leave_slots_for_others() -> None:
    table = SlotTable()
    table.add_segment(1, 16)
    table.add_subscriber("good")
    for name in ("first", "second", "third"):
        table.add_subscriber(name)
        for _ in range(50):
            slot = table.take(1)
            assert slot is not None
            for each in (name, "good"):
                if table.has_free_slot(each, 50):
                    table.give(each, slot)
            table.release(slot)
            table.acknowledge("good", slot, in_use=False)
    assert [table.waiting(name) for name in ("first", "second", "third")] == [8, 4, 3]


def test_a_subscriber_that_keeps_arrays_gets_no_more_slots_and_is_not_waited_for() -> None:
    table = SlotTable()
    table.add_segment(1, SLOTS)
    table.add_subscriber("keeper")
    for _ in range(QUOTA):
        slot = table.take(1)
        assert slot is not None
        table.give("keeper", slot)
        table.acknowledge("keeper", slot, in_use=True)
        table.release(slot)
    assert not table.has_free_slot("keeper")
    assert table.waiting("keeper") == 0
    table.remove_subscriber("keeper")
    assert table.is_unused(1)
