"""Cache of compiled types on disk, so that other processes do not need to compile them again.

An entry is a file named after the type, the location of its definition, and the Python version. An entry is
valid until its definition files change in location, size or modification time, or until the compiler or the
functions that compiled types call change. Entries are code; see `CacheFolder` for which entries are trusted,
and how they are written.
"""

from __future__ import annotations

import marshal
import os
import sys
from binascii import crc32

from pipros.basics.cache_files import CacheFolder
from pipros.basics.errors import NotFound

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from types import CodeType

    from pipros.msg.language.definition_files import DefinitionFiles

    Stamp = tuple[str, str, int, int]

_COMPILER = (
    "base.py",
    "compile/arrays.py",
    "compile/compiled.py",
    "compile/compiler.py",
    "compile/decode.py",
    "compile/emitter.py",
    "compile/encode.py",
    "compile/layout.py",
    "compile/runtime.py",
    "compile/string_arrays.py",
    "errors.py",
    "language/digest.py",
    "language/parse.py",
    "language/spec.py",
    "language/type_names.py",
    "time.py",
)
"""The files that generate the code, and the files with functions that the code calls."""

_MAGIC = b"pipros message 1\n"


class CompiledTypes:
    """A folder in which the compiled code of types is cached."""

    def __init__(self, folder: str, files: DefinitionFiles, compiler: Sequence[str] = _COMPILER) -> None:
        """Store the settings. A change to any file listed in `compiler` invalidates all entries."""
        self._folder = CacheFolder(folder)
        self._files = files
        folder_of_msg = os.path.dirname(os.path.dirname(__file__))
        archive = getattr(globals()["__loader__"], "archive", None)
        compilers = [archive] if archive else [os.path.join(folder_of_msg, name) for name in compiler]
        self._compiler = tuple(map(_file_stamp, compilers))

    def get(self, kind: str, type_name: str) -> tuple[CodeType, Mapping[str, str]] | None:
        """Return a type's code and the names that it uses for embedded types.

        Return None if there is no valid entry.
        """
        try:
            data = self._folder.read(self._entry(kind, type_name))
        except OSError:  # the path is relative, and the working directory no longer exists
            return None
        if data is None:
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
        """Store a type's code and the names that it uses for embedded types, if possible."""
        try:
            entry = self._entry(kind, type_name)
            stamps = [self._stamp(kind, type_name), *(self._stamp("msg", inner) for inner in embedded)]
        except (OSError, NotFound):
            return
        payload = marshal.dumps((self._compiler, stamps, code, dict(embedded)))
        self._folder.write(entry, _MAGIC + len(payload).to_bytes(8, "little") + payload)

    def _entry(self, kind: str, type_name: str) -> str:
        place = crc32(os.fsencode(os.path.abspath(self._files.file(kind, type_name))))
        python = f"{sys.implementation.cache_tag}-{sys.hexversion:x}"
        return f"{type_name.replace('/', '.')}.{kind}.{place:08x}.{python}"

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
