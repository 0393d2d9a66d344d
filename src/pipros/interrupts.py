"""Keeps a Ctrl-C that Python would drop. Importing this module turns that on, for the whole process.

Python raises KeyboardInterrupt wherever the main thread happens to be. When that is a `__del__` or a
callback of the garbage collector, which every import runs through, it can only report the exception as
ignored, and the program goes on as if nobody had pressed anything. Here it is pressed again, from
another thread: in the report itself the next exception would be ignored as well.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import time
from typing import Any

#: The report is over by then.
AGAIN_S = 0.02

_report = sys.unraisablehook


def _press_again() -> None:
    time.sleep(AGAIN_S)
    main = threading.main_thread().ident
    if main is not None and hasattr(signal, "pthread_kill"):  # which ends a wait of the main thread as well
        signal.pthread_kill(main, signal.SIGINT)
    else:
        _thread.interrupt_main()


def _keep(unraisable: Any) -> None:
    if unraisable.exc_type is KeyboardInterrupt:
        _thread.start_new_thread(_press_again, ())
    else:
        _report(unraisable)


sys.unraisablehook = _keep
