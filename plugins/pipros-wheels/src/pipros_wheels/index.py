"""Write a static index for a folder of wheels (PEP 503), and a lock file with hashes.

pip installs the highest version that it finds in any of its indexes, so a public project with the same name
could replace a lab's package. An installation is safe if this index is the only one (`--index-url`), or if it
uses the lock file with `--require-hashes`.
"""

from __future__ import annotations

import hashlib
import lzma
import re
import struct
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from email.message import Message
from email.parser import HeaderParser
from html import escape
from pathlib import Path
from urllib.parse import quote

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.replaced_file import write_whole
from pipros_wheels.names import normalized

LOCK_FILE = "requirements.lock"
INDEX_FOLDER = "simple"

_WHEEL = re.compile(
    r"(?P<name>[A-Za-z0-9](?:[A-Za-z0-9_.]*[A-Za-z0-9])?)-(?P<version>[A-Za-z0-9_.!+]+)(?:-\d[^-]*)?"
    r"-[\w.]+-[\w.]+-[\w.]+\.whl",
    re.ASCII,
)
_METADATA_BYTES = 4 * 1024 * 1024
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""The compression methods that wheels use. With other methods, `zipfile` cannot bound the decompressed size.
"""
_CHUNK_BYTES = 1024 * 1024


# The exceptions that zipfile raises for damaged files, including its own error.
_DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    OSError,
    EOFError,
    OverflowError,
    RuntimeError,
    ValueError,
)


class BadWheel(PiprosError):
    """A `.whl` file is not a valid wheel, or a folder contains no wheels."""


@dataclass(frozen=True, slots=True)
class IndexedWheel:
    """A wheel in a folder. `name` is normalized; `requires_python` is empty if unspecified.

    `requires` are the requirements as written in its metadata.
    """

    file: Path
    name: str
    version: str
    sha256: str
    requires_python: str
    requires: tuple[str, ...] = ()


def read_wheel_name(file_name: str) -> tuple[str, str]:
    """Return the normalized name and the version in a wheel's file name.

    Raises:
        BadWheel: it is not a wheel's file name.
    """
    found = _WHEEL.fullmatch(file_name)
    if found is None:
        raise BadWheel(
            f"[{file_name[:200]!a}] is not the file name of a wheel: NAME-VERSION-PYTHON-ABI-PLATFORM.whl"
        )
    return normalized(found["name"]), found["version"].replace("_", "-")


def names_in(folders: Iterable[Path]) -> set[str]:
    """Return the normalized names of the distributions that have wheels in folders."""
    return {found[0] for folder in folders for file in folder.glob("*.whl") if (found := _name_of(file))}


def _name_of(file: Path) -> tuple[str, str] | None:
    try:
        return read_wheel_name(file.name)
    except BadWheel:
        return None


def wheels_in(folder: Path, errors: list[str]) -> list[IndexedWheel]:
    """Return the wheels in a folder, sorted by name and file.

    Args:
        errors: receives the reason for each `.whl` file that is left out, because it is not a valid wheel or
            cannot be read.
    """
    found = []
    for file in sorted(folder.glob("*.whl")):
        try:
            found.append(read_wheel(file))
        except (BadWheel, OSError) as error:
            errors.append(str(error))
    return sorted(found, key=lambda wheel: (wheel.name, wheel.file.name))


def read_wheel(file: Path) -> IndexedWheel:
    """Return a wheel's name, version, hash and requirements.

    Raises:
        BadWheel: the file is not a wheel.
        OSError: the file cannot be read.
    """
    name, version = read_wheel_name(file.name)
    metadata = metadata_of_wheel(file)
    digest = hashlib.sha256()
    with open_file(file) as opened:
        while chunk := opened.read(_CHUNK_BYTES):
            digest.update(chunk)
    return IndexedWheel(
        file,
        name,
        version,
        digest.hexdigest(),
        " ".join(str(metadata.get("Requires-Python", "")).split()),
        tuple(" ".join(str(item).split()) for item in metadata.get_all("Requires-Dist") or ()),
    )


def metadata_of_wheel(file: Path) -> Message:
    """Return the headers in a wheel's `METADATA`.

    Raises:
        BadWheel: the file is not a wheel. A pipe is not read, because a read might never end.
    """
    if file.exists() and not file.is_file():
        raise BadWheel(f"{file} is not a wheel: it is not a regular file")
    try:
        with zipfile.ZipFile(file) as archive:
            for info in archive.infolist():
                folder, _, name = info.filename.partition("/")
                if folder.endswith(".dist-info") and name == "METADATA" and info.file_size <= _METADATA_BYTES:
                    return HeaderParser().parsestr(_content(archive, info).decode("utf-8", "replace"))
    except _DAMAGES as error:
        raise BadWheel(f"{file} is not a wheel: {error}") from None
    raise BadWheel(f"{file} is not a wheel: it has no METADATA")


def _content(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> bytes:
    """Return the content of a file in an archive, without decompressing more than its declared size.

    `ZipFile.read` first decompresses everything, up to 2 GiB, and then truncates the result.

    Raises:
        BadZipFile: the file is neither stored nor deflated, so its decompression cannot be bounded.
    """
    if info.compress_type not in _COMPRESSIONS:
        raise zipfile.BadZipFile(f"{info.filename} must be stored or deflated")
    with archive.open(info) as opened:
        return opened.read(info.file_size)


def write_index(folder: Path, errors: list[str]) -> list[Path]:
    """Write the index and the lock file of the wheels in a folder, and return the paths of the files.

    Index pages of distributions that have no wheels in the folder are removed.

    Args:
        errors: receives the reason for each `.whl` file that is left out.

    Raises:
        BadWheel: the folder contains no wheels.
        OSError: a file cannot be written.
    """
    wheels = wheels_in(folder, errors)
    if not wheels:
        raise BadWheel("\n".join([*errors, f"{folder} has no wheels; pipros wheel -o {folder} builds them"]))
    simple = folder / INDEX_FOLDER
    names = sorted({wheel.name for wheel in wheels})
    pages = {simple / "index.html": _page("Index", [_link(f"{name}/", name) for name in names])}
    for name in names:
        matching = [wheel for wheel in wheels if wheel.name == name]
        pages[simple / name / "index.html"] = _page(name, map(_link_to_wheel, matching))
    pages[folder / LOCK_FILE] = lock_text(wheels)
    for outdated in simple.glob("*/index.html"):
        if outdated not in pages:
            outdated.unlink()
            outdated.parent.rmdir()
    for file, text in pages.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, text.encode())
    return list(pages)


def lock_text(wheels: Sequence[IndexedWheel]) -> str:
    """Return the contents of a lock file: the newest version of each distribution, with its hashes."""
    lines = ["# Written by pipros index. pip install --require-hashes -r requirements.lock"]
    for name in dict.fromkeys(wheel.name for wheel in wheels):
        matching = [wheel for wheel in wheels if wheel.name == name]
        newest = max(matching, key=lambda wheel: version_key(wheel.version)).version
        hashes = sorted(wheel.sha256 for wheel in matching if wheel.version == newest)
        lines.append(
            " \\\n    ".join([f"{name}=={newest}", *(f"--hash=sha256:{digest}" for digest in hashes)])
        )
    return "\n".join([*lines, ""])


def version_key(version: str) -> tuple[tuple[int, ...], int, str]:
    """Return a key for versions such as 1.10.2; a pre-release such as 1.10.2rc1 precedes its release.

    1.10 and 1.10.0 are equal.
    """
    numbers = re.match(r"(?:\d+!)?((?:\d+\.){0,99}\d+)", version)
    release = (
        tuple(int(part[:9]) for part in re.sub(r"(?<!\.0)(\.0){1,99}$", "", numbers[1]).split("."))
        if numbers
        else ()
    )
    rest = version[numbers.end() :] if numbers else version
    is_final = not rest or rest.startswith((".post", "+"))
    return release, int(is_final), rest


def _link_to_wheel(wheel: IndexedWheel) -> str:
    link = f"../../{quote(wheel.file.name)}#sha256={wheel.sha256}"
    return _link(link, wheel.file.name, wheel.requires_python)


def _link(target: str, text: str, requires_python: str = "") -> str:
    needed = f' data-requires-python="{escape(requires_python)}"' if requires_python else ""
    return f'<a href="{escape(target)}"{needed}>{escape(text)}</a><br>'


def _page(title: str, lines: Iterable[str]) -> str:
    head = '<!DOCTYPE html>\n<html><head><meta charset="utf-8">'
    return "\n".join([f"{head}<title>{escape(title)}</title></head><body>", *lines, "</body></html>", ""])
