"""Record topics into the page's bag folder: one recording at a time, shown in all browsers."""

from __future__ import annotations

import contextlib
import re
import shutil
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.file_names import is_device
from pipros.basics.limits import limit_text, process_limits
from pipros.node import Node
from pipros_page.bags.folder import BagFolder
from pipros_page.limits import PageLimits
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.recorder import Recorder

ENDINGS: Final = (".bag", ".mcap")
ENDING_S: Final = 5.0
"""Maximum time (s) to wait until the file of a stopped recording is complete."""
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
_WARNINGS: Final = 3


class RecordingRefused(BagError):
    """A recording cannot be started."""


@dataclass(frozen=True, slots=True)
class RecordingPlan:
    """A browser's request for a recording.

    Attributes:
        name: file name; `.bag` is appended unless it ends in `.bag` or `.mcap`. Defaults to date and time.
        topics: names of topics; empty for all topics, including topics that appear later.
        size_bytes, duration_s: limits after which the recording ends; 0 for none.
    """

    name: str = ""
    topics: Sequence[str] = ()
    size_bytes: int = 0
    duration_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RecordingState:
    """State of the current or last recording, as shown in browsers.

    Attributes:
        topics: number of topics to which the recorder has subscribed.
        size: size of the file in bytes.
        seconds: duration so far.
        problem: the last warnings, and the reason if the recording failed; empty if there are none.
    """

    name: str
    is_running: bool
    topics: int
    messages: int
    size: int
    seconds: float
    problem: str


class _Recording:
    """One recording, which runs in its own thread with its own node."""

    def __init__(self, path: Path, options: RecordOptions, environment: Environment) -> None:
        self.path = path
        self._begun_s, self._seconds = time.monotonic(), 0.0
        self._warnings: deque[str] = deque(maxlen=_WARNINGS)
        self._node = Node("record", anonymous=True, environment=environment)
        self._recorder = Recorder(self._node, options, say=lambda _: None, warn=self._warnings.append)
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        return self._thread.is_alive()

    def stop(self, timeout_s: float) -> None:
        """End the recording, and wait up to `timeout_s` for its file to be completed."""
        self._node.shutdown("the recording ends")
        self._thread.join(timeout_s)

    def state(self) -> RecordingState:
        path = self.path.with_name(f"{self.path.name}.active") if self.is_running else self.path
        size = 0
        with contextlib.suppress(OSError):
            size = path.stat().st_size
        seconds = time.monotonic() - self._begun_s if self.is_running else self._seconds
        recorder, problem = self._recorder, "; ".join(self._warnings)
        return RecordingState(
            self.path.name,
            self.is_running,
            recorder.topics,
            recorder.written,
            size,
            round(seconds, 1),
            problem,
        )

    def _run(self) -> None:
        try:
            with self._node:
                with contextlib.suppress(PiprosError):  # without a master, use the machine's time
                    if self._node.params.get("/use_sim_time") is True:
                        self._node.use_simulated_time()
                self._recorder.run()
        except (PiprosError, OSError) as error:
            self._warnings.append(str(error))
        finally:
            self._seconds = time.monotonic() - self._begun_s


class BagRecording:
    """Starts and stops recordings in a folder. All methods block."""

    def __init__(self, folder: BagFolder) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._recording: _Recording | None = None

    def start(self, plan: RecordingPlan, environment: Environment) -> None:
        """Start a recording.

        Raises:
            RecordingRefused: a recording is running, the name is invalid or taken, or the disk is too full.
        """
        path, spare = self._path(plan.name), self.spare_bytes()
        if spare <= 0:
            limit = limit_text(
                "page_record_spare_bytes", process_limits().of(PageLimits).page_record_spare_bytes
            )
            raise RecordingRefused(f"too little space is free in {self._folder.path}; {limit}")
        options = RecordOptions(
            topics=plan.topics,
            all=not plan.topics,
            min_space_bytes=process_limits().of(PageLimits).page_record_spare_bytes,
            ends_without_space=True,
            files=FileOptions(
                name=str(path),
                size_bytes=min(plan.size_bytes or spare, spare),
                duration_s=plan.duration_s,
            ),
        )
        with self._lock:
            if self._recording is not None and self._recording.is_running:
                raise RecordingRefused(f"{self._recording.path.name} is being recorded; stop it first")
            self._recording = _Recording(path, options, environment)

    def stop(self) -> None:
        """End the recording, if one is running, and wait at most `ENDING_S` until its file is complete."""
        with self._lock:
            recording = self._recording
        if recording is not None:
            recording.stop(ENDING_S)

    def state(self) -> RecordingState | None:
        """Return the state of the current or last recording, or None before the first recording."""
        recording = self._recording
        return None if recording is None else recording.state()

    def spare_bytes(self) -> int:
        """Return by how many bytes the free disk space exceeds `page_record_spare_bytes`; may be negative."""
        return (
            shutil.disk_usage(self._folder.path).free
            - process_limits().of(PageLimits).page_record_spare_bytes
        )

    def _path(self, name: str) -> Path:
        name = name or time.strftime("%Y-%m-%d-%H-%M-%S")
        if not _NAME.fullmatch(name):
            raise RecordingRefused(
                "the name of a recording must consist of at most 100 letters, digits, dots, hyphens and "
                f"underscores, and begin with a letter or digit, got {name!r:.120}"
            )
        if is_device(name):
            raise RecordingRefused(f"a recording cannot be named {name}, which Windows treats as a device")
        path = self._folder.path / (name if name.endswith(ENDINGS) else f"{name}.bag")
        for taken in (path, path.with_name(f"{path.name}.active")):
            if taken.exists() or taken.is_symlink():
                raise RecordingRefused(f"{taken.name} already exists; choose another name")
        return path
