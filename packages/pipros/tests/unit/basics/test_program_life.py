from __future__ import annotations

import signal
import threading

import pytest

from pipros.basics.interruptible_wait import OnceEvent, ProgramLife, run_until_signalled
from pipros.basics.interrupts import interrupt_main_thread


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
