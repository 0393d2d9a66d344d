from __future__ import annotations

from queue import SimpleQueue

import pytest

from pipros.interruptible_wait import SLICE_S, take_within_slice, wait_in_slices


def test_an_endless_wait_is_made_of_slices_until_it_succeeds() -> None:
    waits: list[float] = []

    def third_time(timeout_s: float) -> bool:
        waits.append(timeout_s)
        return len(waits) == 3

    assert wait_in_slices(third_time)
    assert waits == [SLICE_S] * 3


@pytest.mark.parametrize("timeout_s", [-1, 0, SLICE_S / 2, SLICE_S])
def test_a_short_wait_is_one_wait(timeout_s: float) -> None:
    waits: list[float] = []
    assert not wait_in_slices(lambda limit_s: bool(waits.append(limit_s)), timeout_s)
    assert waits == [max(timeout_s, 0)]


def test_a_wait_ends_when_its_time_is_over() -> None:
    waits: list[float] = []
    assert not wait_in_slices(lambda limit_s: bool(waits.append(limit_s)), SLICE_S * 1.01)
    assert all(0 <= limit_s <= SLICE_S for limit_s in waits)


def test_an_item_of_a_queue_is_taken_at_once_and_an_empty_queue_gives_none() -> None:
    queue: SimpleQueue[str] = SimpleQueue()
    queue.put("event")
    assert take_within_slice(queue, -1) == "event"
    assert take_within_slice(queue, -1) is None
    assert take_within_slice(queue, 1e-3) is None
