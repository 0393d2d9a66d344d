"""Write wheels and source archives whose bytes depend only on their contents.

Entries are sorted and have the same timestamp: `SOURCE_DATE_EPOCH` or, by default, the start of 1980, the
earliest time that zip files support.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import os
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.planted import refuse_planted
from pipros.basics.replaced_file import naming
from pipros.basics.windows import replace_file

_EARLIEST = 315532800
_CHUNK_BYTES = 1024 * 1024
_FILE_MODE, _PROGRAM_MODE = 0o100644, 0o100755


class BadDate(PiprosError):
    """`SOURCE_DATE_EPOCH` is not a valid time."""


@dataclass(frozen=True, slots=True)
class ArchiveEntry:
    """A file in an archive: its content, or the file that contains it."""

    content: bytes | Path
    is_program: bool = False


def write_wheel(file: Path, entries: Mapping[str, ArchiveEntry], info: str) -> None:
    """Write a wheel, including its `RECORD`. The file appears only when it is complete.

    Args:
        entries: the entries by path.
        info: the name of the `.dist-info` folder.

    Raises:
        BadDate: `SOURCE_DATE_EPOCH` is not a valid time.
        OSError: a file cannot be read or written.
    """
    date = time.gmtime(_timestamp())[:6]
    record = []
    refuse_planted(file.parent)
    with naming(file), tempfile.TemporaryDirectory(dir=file.parent, prefix=".pipros-") as folder:
        made = Path(folder, file.name)
        with zipfile.ZipFile(made, "w") as archive:
            for path in _in_order(entries, info):
                entry = entries[path]
                written = _zip_info(path, date, entry.is_program)
                digest, size = hashlib.sha256(), 0
                with _opened(entry) as source, archive.open(written, "w") as target:
                    while chunk := source.read(_CHUNK_BYTES):
                        digest.update(chunk)
                        size += len(chunk)
                        target.write(chunk)
                text = base64.urlsafe_b64encode(digest.digest()).rstrip(b"=").decode()
                record.append(f"{_quoted(path)},sha256={text},{size}\n")
            record_name = f"{info}/RECORD"
            archive.writestr(_zip_info(record_name, date, False), "".join([*record, f"{record_name},,\n"]))
        replace_file(made, file)


def write_source_archive(file: Path, entries: Mapping[str, ArchiveEntry]) -> None:
    """Write a `.tar.gz` file. The file appears only when it is complete."""
    date = _timestamp()
    refuse_planted(file.parent)
    with naming(file), tempfile.TemporaryDirectory(dir=file.parent, prefix=".pipros-") as folder:
        made = Path(folder, file.name)
        with (
            made.open("wb") as raw,
            gzip.GzipFile("", "wb", 9, raw, date) as packed,
            tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive,
        ):
            for path in sorted(entries):
                with _opened(entries[path]) as source:
                    info = tarfile.TarInfo(path)
                    info.size = source.seek(0, io.SEEK_END)
                    source.seek(0)
                    info.mtime = date
                    info.mode = 0o755 if entries[path].is_program else 0o644
                    archive.addfile(info, source)
        replace_file(made, file)


def _timestamp() -> int:
    text = os.environ.get("SOURCE_DATE_EPOCH", "")
    if text and not (text.isascii() and text.isdecimal() and len(text) <= 10):
        raise BadDate(f"SOURCE_DATE_EPOCH must be seconds since 1970, at most 10 digits, got [{text}]")
    return max(int(text or 0), _EARLIEST)


def _in_order(entries: Iterable[str], info: str) -> list[str]:
    """Sort paths, with those in `.dist-info` last, as PEP 427 recommends."""
    return sorted(entries, key=lambda path: (path.startswith(f"{info}/"), path))


def _zip_info(path: str, date: tuple[int, ...], is_program: bool) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(path, date)  # type: ignore[arg-type] # the six numbers
    info.compress_type = zipfile.ZIP_DEFLATED
    info.create_system = 3  # Unix: `external_attr` contains Unix modes
    info.external_attr = (_PROGRAM_MODE if is_program else _FILE_MODE) << 16
    return info


def _opened(entry: ArchiveEntry) -> BinaryIO:
    return io.BytesIO(entry.content) if isinstance(entry.content, bytes) else open_file(entry.content)


def _quoted(path: str) -> str:
    """Return a path as a CSV field, quoted if necessary."""
    return '"' + path.replace('"', '""') + '"' if any(sign in path for sign in ',"\r\n') else path
