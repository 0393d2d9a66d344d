"""Compiled types on disk, so that the next process need not compile them again.

An entry is a file that lies, like the `.pyc` of a module with `PYTHONPYCACHEPREFIX`, below the
cache's folder in the folder of its definition. It is good as long as all definition files that went
into it are found in the same places and have kept their size and time, and the compiler is the one
that made it. Entries are replaced in one step and checked before use, so processes may share the
folder; one that cannot be read or written is done without.
"""

from __future__ import annotations

import _thread
import marshal
import os
import sys

from pipros.errors import NotFound

TYPE_CHECKING = False  # as type checkers see it; this module is on the way of every first import
if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import CodeType

    from pipros.msg.files import DefinitionFiles

    Stamp = tuple[str, str, int, int]

_COMPILER = (
    "compiler.py",
    "decode.py",
    "digest.py",
    "encode.py",
    "parse.py",
    "runtime.py",
    "shape.py",
    "source.py",
    "spec.py",
    "strings.py",
)
_MAGIC = b"pipros message 1\n"


class CompiledTypes:
    """Keeps the code of types below `folder`."""

    def __init__(self, folder: str, files: DefinitionFiles) -> None:
        self._folder = folder
        self._files = files
        here = os.path.dirname(__file__)
        self._compiler = tuple(_file_stamp(os.path.join(here, name)) for name in _COMPILER)

    def get(self, kind: str, type_name: str) -> tuple[CodeType, Mapping[str, str]] | None:
        """The code of a type and its names for embedded types, as `put` got them; None if stale."""
        try:
            data = _read_own(self._entry(kind, type_name))
        except OSError:
            return None
        payload = data.removeprefix(_MAGIC)[8:]
        if not data.startswith(_MAGIC) or len(payload) != int.from_bytes(data[len(_MAGIC) :][:8], "little"):
            return None
        try:
            compiler, stamps, code, embedded = marshal.loads(payload)  # noqa: S302 # a file of our own
        except (ValueError, EOFError, TypeError):
            return None
        if compiler != self._compiler or not all(self._is_current(stamp) for stamp in stamps):
            return None
        return code, embedded

    def put(self, kind: str, type_name: str, code: CodeType, embedded: Mapping[str, str]) -> None:
        """Keeps the code of a type, if that is possible."""
        try:
            stamps = [self._stamp(kind, type_name), *(self._stamp("msg", inner) for inner in embedded)]
            entry = self._entry(kind, type_name)
            payload = marshal.dumps((self._compiler, stamps, code, dict(embedded)))
            _replace(entry, _MAGIC + len(payload).to_bytes(8, "little") + payload)
        except (OSError, NotFound):
            pass

    def _entry(self, kind: str, type_name: str) -> str:
        place = os.path.splitdrive(os.path.abspath(self._files.file(kind, type_name)))[1].lstrip(os.sep)
        name = type_name.partition("/")[2]
        python = f"{sys.implementation.cache_tag}-{sys.hexversion:x}"
        return os.path.join(self._folder, os.path.dirname(place), f"{name}.{kind}.{python}")

    def _stamp(self, kind: str, type_name: str) -> Stamp:
        file = self._files.file(kind, type_name)
        return (f"{kind}/{type_name}", file, *_file_stamp(file))

    def _is_current(self, stamp: Stamp) -> bool:
        kind, _, type_name = stamp[0].partition("/")
        try:
            return self._stamp(kind, type_name) == stamp
        except (OSError, NotFound):
            return False


def _file_stamp(path: str) -> tuple[int, int]:
    status = os.stat(path)
    return status.st_mtime_ns, status.st_size


def _read_own(path: str) -> bytes:
    """The content of a file of this user: what others put there is not for us to run.

    Raises:
        OSError: there is no such file, or it is somebody else's.
    """
    with open(path, "rb") as file:
        if hasattr(os, "getuid") and os.fstat(file.fileno()).st_uid != os.getuid():
            raise PermissionError(f"{path} belongs to another user")
        return file.read()


def _replace(path: str, data: bytes) -> None:
    os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
    unfinished = f"{path}.{os.getpid()}-{_thread.get_ident()}"
    try:
        with open(unfinished, "wb") as file:
            file.write(data)
        os.replace(unfinished, path)
    except OSError:
        if os.path.exists(unfinished):
            os.unlink(unfinished)
        raise
