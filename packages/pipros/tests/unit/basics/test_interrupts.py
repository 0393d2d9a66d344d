"""Ctrl-C ends the program even if it arrives where Python ignores exceptions."""

import gc
import signal
import subprocess
import sys
import threading
from itertools import count
from queue import SimpleQueue
from types import FrameType
from typing import Any

import pytest

from pipros.basics.interruptible_wait import (
    SLICE_S,
    OnceEvent,
    ProgramLife,
    get_within_slice,
    run_until_signalled,
    wait_in_slices,
)
from pipros.basics.interrupts import interrupt_main_thread

PROGRAM = """
import signal, time, weakref
{start}

class Thing:
    pass

def interrupted(_):
    signal.raise_signal(signal.SIGINT)
    sum(range(100))  # Python sees to signals between its instructions

thing = Thing()
reference = weakref.ref(thing, interrupted)
try:
    del thing
    time.sleep({patience_s})
    print("went on")
except KeyboardInterrupt:
    print("ended")
"""


@pytest.mark.parametrize("start", [
    "import rospy", "from pipros_tools.cli.entry_point import command; command(lambda: 0)()",
    "from pipros.basics.interrupts import install; install(); install()",
])  # fmt: skip
def test_an_interrupt_in_a_callback_of_the_garbage_collector_counts(start: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(start=start, patience_s=10)], capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("ended\n", "")


def test_no_import_changes_the_process() -> None:
    modules = ["pipros.basics.interrupts", "pipros_tools.cli.runner", "pipros_tools.cli.rostopic"]
    program = (
        "import sys; from importlib import import_module; hook = sys.unraisablehook\n"
        f"print([name for name in {modules} if import_module(name) and sys.unraisablehook is not hook])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_other_ignored_exceptions_are_reported_as_ever() -> None:
    program = PROGRAM.format(start="import rospy", patience_s=0).replace(
        "signal.raise_signal(signal.SIGINT)", "1 / 0"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout == "went on\n"
    assert "ZeroDivisionError" in done.stderr


STARTING = """
import signal, threading, time
from pipros.basics.interrupts import install
install()

interrupted = threading.Event()

class Late(threading.Thread):
    def _bootstrap(self):  # what the new thread runs first
        interrupted.wait(60)
        time.sleep(0.1)
        print("started", flush=True)
        super()._bootstrap()

def interrupt(*_):
    signal.setitimer(signal.ITIMER_REAL, 0)
    raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)  # again, because the other thread may receive a signal
try:
    Late(target=time.sleep, args=(60,), daemon=True).start()
except KeyboardInterrupt:
    print("interrupted", flush=True)
    interrupted.set()
"""


def test_a_program_waits_at_exit_for_a_thread_whose_start_was_interrupted() -> None:
    done = subprocess.run([sys.executable, "-c", STARTING], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "interrupted\nstarted\n", "")


@pytest.mark.needs("programs that replace a process")
@pytest.mark.parametrize(("handler", "code"), [("SIG_IGN", 0), ("default_int_handler", -signal.SIGINT)])
def test_no_signal_is_lost_before_another_program_replaces_this_one(handler: str, code: int) -> None:
    program = (
        "import os, signal, sys; from pipros.basics.interrupts import forget_handlers\n"
        f"signal.signal(signal.SIGINT, signal.{handler}); forget_handlers()\n"
        "os.kill(os.getpid(), signal.SIGINT); os.execv(sys.executable, [sys.executable, '-c', ''])\n"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == code


# Interruptible wait


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


# Program life


def test_the_result_of_the_program_is_returned() -> None:
    assert run_until_signalled(lambda life: life.over.is_set()) is False


def test_an_error_of_the_program_is_raised_in_the_main_thread() -> None:
    def fail(_: ProgramLife) -> None:
        raise ValueError("no port")

    with pytest.raises(ValueError, match="no port"):
        run_until_signalled(fail)


def test_a_signal_interrupts_a_start_that_waits() -> None:
    answered = threading.Event()

    def program(life: ProgramLife) -> str:
        assert threading.current_thread() is not threading.main_thread()
        with life.interrupted_by(answered.set):
            interrupt_main_thread()
            assert answered.wait(60)
        return "ended in order"

    before = signal.getsignal(signal.SIGINT)
    assert run_until_signalled(program, grace_s=60) == "ended in order"
    assert signal.getsignal(signal.SIGINT) is before


def test_a_start_that_has_ended_is_not_interrupted() -> None:
    interrupted = OnceEvent()

    def program(life: ProgramLife) -> bool:
        with life.interrupted_by(interrupted.set):
            pass
        interrupt_main_thread()
        life.over.wait()
        return interrupted.is_set()

    assert run_until_signalled(program, grace_s=60) is False


def test_a_program_that_does_not_end_is_left_behind() -> None:
    released = threading.Event()

    def program(_: ProgramLife) -> bool:
        interrupt_main_thread()
        return released.wait(60)

    try:
        assert run_until_signalled(program, grace_s=0.1) is None
    finally:
        released.set()
