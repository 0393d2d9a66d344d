"""No compiled program, library or archive is in the repository: tests stand on recorded answers and packages.

Libraries of other projects in JavaScript are text, and listed in THIRD_PARTY.md. Recordings are compressed
JSON.
"""

import gzip
import json
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

from tests.support.environments import REPOSITORY, file_of_tests
from tests.support.recordings import FOLDER, load

CORPUS = file_of_tests("fuzz/corpus")
"""Inputs for readers, among them a small wheel of our own."""
RECORDED = REPOSITORY / "plugins" / "pipros-robot" / "benchmarks" / "recorded"
FOLDERS = (".ci", ".github", "docs", "examples", "packages", "plugins", "script")
MAGIC = {
    "ELF": b"\x7fELF", "ar or deb": b"!<arch>", "PE": b"MZ", "WebAssembly": b"\x00asm",
    "zip or wheel": b"PK\x03\x04", "gzip": b"\x1f\x8b", "xz": b"\xfd7zXZ\x00", "bzip2": b"BZh",
    "Zstandard": b"\x28\xb5\x2f\xfd", "7z": b"7z\xbc\xaf\x27\x1c", "RPM": b"\xed\xab\xee\xdb",
    "Mach-O (32)": b"\xce\xfa\xed\xfe", "Mach-O (64)": b"\xcf\xfa\xed\xfe",
    "Mach-O (32, big-endian)": b"\xfe\xed\xfa\xce", "Mach-O (64, big-endian)": b"\xfe\xed\xfa\xcf",
    "Mach-O (universal) or Java": b"\xca\xfe\xba\xbe",
}  # fmt: skip
_TAR, _TAR_AT = b"ustar", 257


def kind_of(start: bytes) -> str:
    """Return the format of a compiled file or an archive, from its first bytes; otherwise an empty string."""
    if start[_TAR_AT : _TAR_AT + len(_TAR)] == _TAR:
        return "tar"
    return next((kind for kind, magic in MAGIC.items() if start.startswith(magic)), "")


def has_only_text(file: Path) -> bool:
    """Return whether a file is a zip archive without compiled files and archives."""
    with zipfile.ZipFile(file) as archive:
        return not any(kind_of(archive.read(name)[:512]) for name in archive.namelist())


def files() -> Iterator[Path]:
    yield from (each for each in REPOSITORY.iterdir() if each.is_file())
    for name in FOLDERS:
        for folder, below, names in os.walk(REPOSITORY / name):
            below[:] = [each for each in below if each != "__pycache__" and not each.endswith(".egg-info")]
            yield from (Path(folder, each) for each in names)


def test_no_compiled_file_and_no_archive_is_in_the_repository() -> None:
    found, recordings = {}, []
    for file in files():
        if file.is_symlink():
            continue
        with file.open("rb") as opened:
            kind = kind_of(opened.read(512))
        if kind == "gzip" and file.is_relative_to(RECORDED) and file.name.endswith(".json.gz"):
            json.loads(gzip.decompress(file.read_bytes()))
        elif kind == "gzip" and file.is_relative_to(FOLDER) and file.name.endswith(".json.gz"):
            recordings.append(file)
        elif kind and not (file.is_relative_to(CORPUS) and has_only_text(file)):
            found[str(file.relative_to(REPOSITORY))] = kind

    assert found == {}
    assert len(recordings) > 50
    for file in recordings:
        assert load(file)["format"] == 1, file
