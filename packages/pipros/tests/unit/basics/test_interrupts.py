"""Ctrl-C ends the program even if it arrives where Python ignores exceptions."""

import signal
import subprocess
import sys

import pytest

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


@pytest.mark.parametrize(
    "start",
    [
        "import rospy",
        "from pipros_tools.cli.entry_point import command; command(lambda: 0)()",
        "from pipros.basics.interrupts import install; install(); install()",
    ],
)
def test_an_interrupt_in_a_callback_of_the_garbage_collector_counts(start: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(start=start, patience_s=10)],
        capture_output=True,
        text=True,
        check=False,
    )
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
