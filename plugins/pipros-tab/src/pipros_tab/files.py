"""The files of the home folder, which all workers of a tab share.

Theory of operation. Each worker has its own copy in memory. It gets all files when it starts. When it starts
another program, after each line of a terminal, and when it ends, it sends the files that have changed to the
hub, which passes them to all other workers. The last change of a file wins.
"""

from __future__ import annotations

import json
import os
import shutil
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

PIECE_BYTES: Final = 48 * 1024
"""Maximum number of bytes of a file in one packet. The packet also contains the path."""

_NOT_SHARED: Final = "__pycache__"

_State = tuple[int, int, int]


class SharedFiles:
    """The home folder of one worker."""

    def __init__(self, folder: str, send: Callable[[bytes], None]) -> None:
        """Take what the folder contains as known to the hub.

        Args:
            send: sends the content of a FILE packet.
        """
        self._folder = folder
        self._send = send
        self._pieces: dict[str, list[bytes]] = {}
        self._known = dict(_states(folder))

    def push(self) -> None:
        """Send what has changed since the last call."""
        states = dict(_states(self._folder))
        for path in sorted(self._known.keys() - states.keys(), reverse=True):
            self._send(_packed({"path": path}))
        for path, state in states.items():
            if self._known.get(path) != state:
                self._push_file(path, state[2])
        self._known = states

    def _push_file(self, path: str, mode: int) -> None:
        content = b"" if stat.S_ISDIR(mode) else Path(path).read_bytes()
        for start in range(0, max(len(content), 1), PIECE_BYTES):
            is_last = start + PIECE_BYTES >= len(content)
            head = {"path": path, "mode": mode, "is_last": is_last}
            self._send(_packed(head, content[start : start + PIECE_BYTES]))

    def take(self, packet: bytes) -> None:
        """Write a file that another worker has changed, once all its pieces have arrived, or remove it."""
        line, _, piece = packet.partition(b"\n")
        head = json.loads(line)
        path = head["path"]
        if "mode" not in head:
            self._known.pop(path, None)
            remove(path)
            return
        pieces = self._pieces.setdefault(path, [])
        pieces.append(piece)
        if head["is_last"]:
            del self._pieces[path]
            write(path, head["mode"], b"".join(pieces))
            self._known[path] = _state(path)


def write(path: str, mode: int, content: bytes | memoryview) -> None:
    """Write a file, or create a folder if the mode is that of one."""
    file = Path(path)
    if stat.S_ISDIR(mode):
        file.mkdir(parents=True, exist_ok=True)
    else:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        file.chmod(stat.S_IMODE(mode))


def write_all(files: Mapping[str, Any]) -> None:
    """Write files: text, or a mode and bytes, by path."""
    for path, content in sorted(files.items()):
        if isinstance(content, str):
            write(path, 0o644, content.encode())
        else:
            write(path, *content)


def remove(path: str) -> None:
    """Remove a file or a folder, if it exists."""
    if os.path.isdir(path):
        shutil.rmtree(path, ignore_errors=True)
    else:
        Path(path).unlink(missing_ok=True)


def _packed(head: Mapping[str, Any], piece: bytes = b"") -> bytes:
    return json.dumps(head).encode() + b"\n" + piece


def _states(folder: str) -> Iterator[tuple[str, _State]]:
    for parent, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name != _NOT_SHARED]
        for name in (*folders, *names):
            path = os.path.join(parent, name)
            if os.path.exists(path) and not (os.path.islink(path) and os.path.isdir(path)):
                yield path, _state(path)


def _state(path: str) -> _State:
    """Return the time, the size and the mode of a file; of a folder, the mode alone."""
    about = os.stat(path)
    if stat.S_ISDIR(about.st_mode):
        return 0, 0, about.st_mode
    return about.st_mtime_ns, about.st_size, about.st_mode
