"""Job objects of Windows, which replace POSIX process groups and the launcher's guardian.

Unlike the guardian, a job needs no process: Windows ends a job's processes when the last handle is closed,
and it closes the handles of every process that ends, even if it is killed.
"""

from __future__ import annotations

import ctypes
import struct
import sys
import threading
from typing import Any

_LIMITS = 9
"""JobObjectExtendedLimitInformation, whose flags are at byte 16 of 144, or of 112 on 32-bit systems."""
_ENDS_WITH_HANDLE = 0x2000
_COUNTS = 1
"""JobObjectBasicAccountingInformation, whose number of running processes is at byte 40 of 48."""
_MAY_ASSIGN = 0x0101
"""PROCESS_TERMINATE and PROCESS_SET_QUOTA"""


class Job:
    """A process with its descendants, which end when the job is closed or when this process ends.

    Descendants that were started before the job was made are not part of it.
    """

    def __init__(self, process_id: int) -> None:
        """Put a process into a new job.

        Raises:
            OSError: the process has exited, or the system has no job objects.
        """
        self._lock = threading.Lock()
        self._handle: int | None = _call("CreateJobObjectW", None, None)
        try:
            limits = bytearray(144 if sys.maxsize > 2**32 else 112)
            struct.pack_into("<I", limits, 16, _ENDS_WITH_HANDLE)
            _call("SetInformationJobObject", _of(self._handle), _LIMITS, bytes(limits), len(limits))
            process = _call("OpenProcess", _MAY_ASSIGN, False, process_id)
            try:
                _call("AssignProcessToJobObject", _of(self._handle), _of(process))
            finally:
                _call("CloseHandle", _of(process))
        except BaseException:
            self.close()
            raise

    def is_running(self) -> bool:
        """Return whether a process of the job is running."""
        with self._lock:
            if self._handle is None:
                return False
            counts = ctypes.create_string_buffer(48)
            _call("QueryInformationJobObject", _of(self._handle), _COUNTS, counts, len(counts), None)
            return bool(struct.unpack_from("<I", counts, 40)[0])

    def end(self) -> None:
        """End all processes of the job, with exit code 1."""
        with self._lock:
            if self._handle is not None:
                _call("TerminateJobObject", _of(self._handle), 1)

    def close(self) -> None:
        """End all processes of the job, and forget it. May be called repeatedly."""
        with self._lock:
            handle, self._handle = self._handle, None
            if handle is not None:
                _call("CloseHandle", _of(handle))


def _of(handle: int) -> ctypes.c_void_p:
    return ctypes.c_void_p(handle)


def _call(name: str, *arguments: object) -> int:
    """Call a function of Windows, and raise an OSError if it returns 0."""
    api: Any = ctypes
    if not hasattr(api, "WinDLL"):
        raise OSError("job objects need Windows")
    result = int(getattr(api.WinDLL("kernel32", use_last_error=True), name)(*arguments))
    if not result:
        raise api.WinError(api.get_last_error())
    return result
