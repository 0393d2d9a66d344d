"""Download test data."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from pipros.basics.windows import replace_file
from pipros.workspace.catkin.project import Download

_TIMEOUT_S = 60.0
_CHUNK_BYTES = 1 << 20


def fetch(download: Download, say: Callable[[str], object]) -> None:
    """Download a file unless it already exists with the right MD5 sum. If that fails, print a warning."""
    path = Path(download.path)
    if path.is_file() and download.md5 in ("", _md5(path)):
        return
    say(f"-- Downloading {download.url} to {path}")
    unfinished = path.with_name(path.name + ".part")
    try:
        _receive(download.url, unfinished)
    except (OSError, ValueError) as error:
        say(f"-- WARNING: {download.url} cannot be downloaded: {error}")
        return
    received = _md5(unfinished)
    if download.md5 not in ("", received):
        say(f"-- WARNING: the MD5 of {download.url} must be {download.md5}, got {received}")
        unfinished.unlink()
        return
    replace_file(unfinished, path)


def _receive(url: str, file: Path) -> None:
    from urllib.error import HTTPError
    from urllib.request import urlopen

    if not url.startswith(("http://", "https://")):
        raise ValueError("the URL must begin with http:// or https://")
    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        answer = urlopen(url, timeout=_TIMEOUT_S)  # noqa: S310  # checked above
    except HTTPError as refused:
        refused.close()  # the error object owns the connection
        raise
    with answer, file.open("wb") as written:
        while chunk := answer.read(_CHUNK_BYTES):
            written.write(chunk)


def _md5(path: Path) -> str:
    digest = hashlib.md5(usedforsecurity=False)
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()
