"""Folders created once for many tests: for all workers of pytest-xdist, or for all runs on this machine."""

import contextlib
import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

from tests.support.locks import lock

_UNUSED_S = 14 * 24 * 3600


def shared_folder(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Return a folder shared by all workers of this run."""
    base = tmp_path_factory.getbasetemp()
    return base if worker_id == "master" else base.parent


@contextlib.contextmanager
def alone(file: Path) -> Iterator[None]:
    """Run the block while no other process runs a block with the same lock file."""
    with file.open("w") as opened:
        lock(opened.fileno(), waits=True)
        yield


def make_once(folder: Path, make: Callable[[], object]) -> Path:
    """Return the folder. If it has not been filled yet, create it, and call `make` to fill it."""
    made = folder / ".made"
    folder.parent.mkdir(parents=True, exist_ok=True)
    with alone(folder.with_name(f"{folder.name}.lock")):
        if not made.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make()
        made.touch()
    return folder


def machine_folder(name: str, sources: Iterable[Path]) -> Path:
    """Return the path of a folder for results that depend on `sources`, to be filled by `make_once`.

    It is kept for later runs. Its name contains a digest of all files in `sources`. Folders with the same
    `name` that have not been used for two weeks are removed.
    """
    digest = hashlib.sha256()
    for source in sources:
        for file in sorted(source.rglob("*")) if source.is_dir() else [source]:
            if file.is_file() and file.suffix != ".pyc":
                digest.update(f"{file.relative_to(source.parent)} {file.stat().st_mode:o}\n".encode())
                digest.update(file.read_bytes())
    base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "pipros" / "tests"
    for made in base.glob(f"{name}-*/.made"):
        with contextlib.suppress(OSError):
            if time.time() - made.stat().st_mtime > _UNUSED_S:
                shutil.rmtree(made.parent)
    return base / f"{name}-{digest.hexdigest()[:16]}"
