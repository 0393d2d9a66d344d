"""Assets that are being sent. Clients that fetch the same file share its content."""

from __future__ import annotations

import threading
import weakref
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.budget import Budget
from pipros.basics.input_file import read_file
from pipros.packages.assets import AssetRefused


@dataclass(frozen=True, eq=False)
class Asset:
    """The content of a file. Its size counts against the limit as long as this object exists."""

    content: bytes


class SentAssets:
    """Reads assets, and limits the memory of the assets that are being sent. Thread-safe."""

    def __init__(self, asset_bytes: int) -> None:
        self._memory = Budget(2 * asset_bytes)
        self._assets: weakref.WeakValueDictionary[tuple[Path, int, int], Asset] = (
            weakref.WeakValueDictionary()
        )
        self._lock = threading.Lock()

    def read(self, file: Path, limit_bytes: int) -> Asset:
        """Return the content of a file. Blocks.

        Raises:
            AssetRefused: too many other assets are being sent.
            OSError: the file cannot be read, or is larger than `limit_bytes`.
        """
        with self._lock:
            status = file.stat()
            key = file, status.st_mtime_ns, status.st_size
            known = self._assets.get(key)
            if known is not None:
                return known
            size = min(status.st_size, limit_bytes)
            if not self._memory.take(size):
                raise AssetRefused("too many assets are being sent; try again later")
            try:
                asset = Asset(read_file(file, limit_bytes))
            except BaseException:
                self._memory.give_back(size)
                raise
            weakref.finalize(asset, self._memory.give_back, size).atexit = False
            self._assets[key] = asset
            return asset
