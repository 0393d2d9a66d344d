"""Run a tool or a node many times, each with a SIGINT at another bytecode of the main thread.

`python -m tests.chaos.interrupt_at {command,node} MOMENT...` prints a line for each run that did not end, and
finally `done`. Only the instructions of `threading` and of pipros's waits count, between which Python
may run a signal handler while a lock is held. The runs are forked children, so that imports are done once.
"""

import os
import select
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any

import rospy
from pipros_tools.cli.rostopic import main as rostopic
from pipros_tools.cli.rostopic.delay import measure_delay  # noqa: F401 # imported before the children are forked
from pipros_tools.graph.listening import Listening  # noqa: F401

_FILES = (threading.__file__, *(f"/pipros/{name}.py" for name in ("interruptible_wait", "graph/listening")))
_ENDS_WITHIN_S = 30.0
_WAITS_S = 0.5  # a program that runs for this long is waiting
_SENT = b"!"


class _Interrupter:
    """A trace function that sends SIGINT to this process at the n-th bytecode instruction."""

    def __init__(self, moment: int, report: int) -> None:
        self._left = moment
        self._report = report

    def __call__(self, frame: FrameType, _event: str, _arg: Any) -> Any:
        if not frame.f_code.co_filename.endswith(_FILES):
            return None
        frame.f_trace = self._step  # raise before the next line; otherwise, Python 3.13 ignores the signal
        frame.f_trace_opcodes = True
        frame.f_trace_lines = False
        return self._step

    def _step(self, _frame: FrameType, event: str, _arg: Any) -> Any:
        if event == "opcode":
            self._left -= 1
            if self._left == 0:
                sys.settrace(None)
                os.write(self._report, _SENT)
                os.kill(os.getpid(), signal.SIGINT)
        return self._step


def _run(what: str) -> int:
    if what == "command":
        return rostopic(["delay", "/chatter"])
    rospy.init_node("node", anonymous=True)
    rospy.spin()
    return 0


def _ends(what: str, moment: int) -> bool:
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        sys.settrace(_Interrupter(moment, writer))
        sys.exit(_run(what))
    os.close(writer)
    if not select.select([reader], [], [], _WAITS_S)[0]:  # this moment is never reached
        os.kill(pid, signal.SIGINT)
    deadline = time.monotonic() + _ENDS_WITHIN_S
    while os.waitpid(pid, os.WNOHANG) == (0, 0):
        if time.monotonic() > deadline:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return False
        time.sleep(0.01)
    os.close(reader)
    return True


def main() -> None:
    what = sys.argv[1]
    for moment in map(int, sys.argv[2:]):
        if not _ends(what, moment):
            print(f"{what}: SIGINT at byte code {moment} was lost", flush=True)
    print("done", flush=True)


if __name__ == "__main__":
    main()
