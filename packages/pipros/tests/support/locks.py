"""Lock files against other processes, on all systems."""

import sys
import time

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_AGAIN_S = 0.1


def lock(descriptor: int, *, waits: bool) -> bool:
    """Lock a file until it is closed. Return False if another process has locked it.

    Args:
        waits: whether to wait until the file is free.
    """
    while True:
        try:
            if sys.platform == "win32":
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            else:
                fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except OSError:
            if not waits:
                return False
            time.sleep(_AGAIN_S)
        else:
            return True
