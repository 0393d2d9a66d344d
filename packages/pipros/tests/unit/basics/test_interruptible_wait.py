from __future__ import annotations

import gc
import signal
import sys
import threading
from itertools import count
from queue import SimpleQueue
from types import FrameType
from typing import Any

import pytest

from pipros.basics.interruptible_wait import SLICE_S, OnceEvent, get_within_slice, wait_in_slices


def test_an_unlimited_wait_is_a_series_of_slices() -> None:
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


def test_a_wait_times_out() -> None:
    waits: list[float] = []
    assert not wait_in_slices(lambda limit_s: bool(waits.append(limit_s)), SLICE_S * 1.01)
    assert all(0 <= limit_s <= SLICE_S for limit_s in waits)


def test_an_item_of_a_queue_is_taken_at_once_and_an_empty_queue_gives_none() -> None:
    queue: SimpleQueue[str] = SimpleQueue()
    queue.put("event")
    assert get_within_slice(queue, -1) == "event"
    assert get_within_slice(queue, -1) is None
    assert get_within_slice(queue, 1e-3) is None


def interrupted_at(byte_code: int, event: OnceEvent) -> bool:
    """Return whether a wait for the event was interrupted by KeyboardInterrupt before that instruction."""
    left = byte_code

    def step(_frame: FrameType, kind: str, _arg: Any) -> Any:
        nonlocal left
        left -= kind == "opcode"
        if left == 0:
            sys.settrace(None)
            raise KeyboardInterrupt
        return step

    def trace(frame: FrameType, _kind: str, _arg: Any) -> Any:
        frame.f_trace = step  # before the next line, which Python 3.13 ignores otherwise
        frame.f_trace_opcodes = True
        return step

    before = sys.gettrace()
    sys._getframe().f_trace_opcodes = True  # Python 3.12 looks for such a frame when tracing begins
    gc.disable()  # an interrupt in a finalizer would be reported instead of raised
    sys.settrace(trace)
    try:
        event.wait(1e-3)
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
        gc.enable()
    return False


@pytest.mark.parametrize("is_set", [False, True])
def test_an_event_works_after_an_interrupt_at_any_byte_code_of_a_wait(is_set: bool) -> None:
    for byte_code in count(1):
        event = OnceEvent()
        if is_set:
            event.set()
        if not interrupted_at(byte_code, event):
            break
        event.set()
        assert event.wait(0)
    assert byte_code >= 5


def test_an_event_ends_every_wait_for_it() -> None:
    event = OnceEvent()
    ended: list[bool] = []
    waiting = [threading.Thread(target=lambda: ended.append(event.wait(30))) for _ in range(3)]
    for thread in waiting:
        thread.start()
    assert not event.wait(0)
    event.set()
    event.set()
    for thread in waiting:
        thread.join(30)
    assert ended == [True] * 3


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer signals here")
def test_a_signal_handler_may_set_an_event_during_its_wait() -> None:
    event = OnceEvent()
    before = signal.signal(signal.SIGALRM, lambda *_: event.set())
    try:
        signal.setitimer(signal.ITIMER_REAL, 1e-3)
        assert event.wait(30)
    finally:
        signal.signal(signal.SIGALRM, before)
