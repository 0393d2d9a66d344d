"""Rules for the slots of a topic's shared memory: who holds which slot, and who may get another one.

This module performs no I/O. A slot without holders is free. The publisher holds a slot while it writes a
message and gives it to subscribers. A subscriber holds the slot until it acknowledges that the slot is free;
if its callbacks get arrays, it first acknowledges that the slot is in use. Each subscriber may have QUOTA
slots in use, and as many slots waiting as its queue holds, but at least QUOTA. Beyond QUOTA, it gets a slot
only if it has fewer than are free, so some remain however many subscribers hang. Further messages are sent
through its socket. A subscriber that hangs or keeps its arrays therefore does not delay the others.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Final

from pipros.basics.errors import ProtocolError
from pipros.wire.slot_frames import Slot

SLOTS: Final = 64
"""Number of slots of a segment, unless the limit on the topic's memory allows only fewer. Slots that are not
used take no memory.
"""
QUOTA: Final = 3
"""Maximum number of a subscriber's slots in use, and of its waiting slots if its queue holds no more."""
FEWEST_SLOTS: Final = 2
"""Minimum number of slots of a segment. With a single slot, no message could be written while another is
being read.
"""


class SlotTable:
    """The holders of all slots. Not thread-safe.

    Attributes:
        quota: QUOTA, or less if the newest segment has only a few slots.
    """

    def __init__(self) -> None:
        self.quota = QUOTA
        self._newest = 0
        # last in, first out, because the slot freed last may still be in the processor's cache
        self._free: dict[int, list[int]] = {}
        self._slots: dict[int, int] = {}
        self._holders: dict[Slot, int] = {}
        self._waiting: dict[Hashable, set[Slot]] = {}
        self._in_use: dict[Hashable, set[Slot]] = {}

    def add_segment(self, segment: int, slots: int) -> None:
        """Add a segment of free slots. Later messages use this segment."""
        self._free[segment] = list(range(slots))
        self._slots[segment] = slots
        self.quota = min(QUOTA, slots - 1)
        self._newest = segment

    def remove_segment(self, segment: int) -> None:
        """Forget an unused segment."""
        del self._free[segment], self._slots[segment]

    def is_unused(self, segment: int) -> bool:
        return len(self._free[segment]) == self._slots[segment]

    @property
    def held_slots(self) -> int:
        """The number of slots with at least one holder."""
        return len(self._holders)

    def add_subscriber(self, subscriber: Hashable) -> None:
        self._waiting[subscriber], self._in_use[subscriber] = set(), set()

    def remove_subscriber(self, subscriber: Hashable) -> None:
        """Release all slots of a subscriber. May be called repeatedly."""
        held = self._waiting.pop(subscriber, set()) | self._in_use.pop(subscriber, set())
        for slot in held:
            self.release(slot)

    def take(self, segment: int) -> Slot | None:
        """Return a free slot, which the publisher then holds; None if there is none."""
        if not self._free[segment]:
            return None
        slot = segment, self._free[segment].pop()
        self._holders[slot] = 1
        return slot

    def release(self, slot: Slot) -> None:
        """Remove one holder of a slot. The slot is free once it has no holders."""
        self._holders[slot] -= 1
        if not self._holders[slot]:
            del self._holders[slot]
            self._free[slot[0]].append(slot[1])

    def has_free_slot(self, subscriber: Hashable, queue_size: int = 0) -> bool:
        """Return whether a subscriber may get another slot. `queue_size` is the size of its queue."""
        if subscriber not in self._waiting or len(self._in_use[subscriber]) >= self.quota:
            return False
        waiting = len(self._waiting[subscriber])
        return waiting < self.quota or waiting < min(queue_size, len(self._free[self._newest]))

    def waiting(self, subscriber: Hashable) -> int:
        """Return the number of slots whose messages a subscriber has not yet delivered."""
        return len(self._waiting.get(subscriber, ()))

    def has_slots(self, subscriber: Hashable) -> bool:
        """Return whether a subscriber holds any slot."""
        return bool(self._waiting.get(subscriber) or self._in_use.get(subscriber))

    def give(self, subscriber: Hashable, slot: Slot) -> None:
        """Add a subscriber to the holders of a slot that the publisher holds."""
        self._waiting[subscriber].add(slot)
        self._holders[slot] += 1

    def take_back(self, subscriber: Hashable, slot: Slot) -> None:
        """Undo `give`, because the slot could not be sent."""
        if slot in self._waiting.get(subscriber, ()):
            self._waiting[subscriber].remove(slot)
            self.release(slot)

    def acknowledge(self, subscriber: Hashable, slot: Slot, *, in_use: bool) -> None:
        """Apply an acknowledgement.

        Raises:
            ProtocolError: the subscriber does not hold the slot.
        """
        waiting, used = self._waiting[subscriber], self._in_use[subscriber]
        if slot in waiting:
            waiting.remove(slot)
            if in_use:
                used.add(slot)
                return
        elif slot in used and not in_use:
            used.remove(slot)
        else:
            raise ProtocolError("it acknowledged a slot of shared memory that it does not hold")
        self.release(slot)
