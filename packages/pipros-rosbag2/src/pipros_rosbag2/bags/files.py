"""Files of a ROS 2 bag: those that `metadata.yaml` lists, or all in a folder without it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.input_file import read_text
from pipros.basics.limits import process_limits
from pipros_rosbag2.bags.mcap_storage import McapStorage, is_of_ros2
from pipros_rosbag2.bags.metadata import BagMetadata, parse_metadata
from pipros_rosbag2.bags.sqlite_files import SqliteReader, has_magic
from pipros_rosbag2.bags.storage import StorageReader
from pipros_tools.bag.errors import BagError, BagFormatError
from pipros_tools.bag.opening import check_no_pointer, is_mcap

_METADATA = "metadata.yaml"
_SUFFIXES = (".mcap", ".db3")
_PACKED = (".zstd", ".zst", ".gz", ".tgz", ".bz2", ".xz", ".lz4", ".zip", ".7z")


def is_ros2_bag(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a ROS 2 bag. See `opened_files` for errors."""
    path = Path(path)
    if path.is_dir():
        return True
    if is_mcap(path):
        return is_of_ros2(path)
    return has_magic(path)


def bag_files(path: Path) -> tuple[BagMetadata | None, list[Path], dict[str, str]]:
    """Return a bag's metadata, its files, and the reason why its `metadata.yaml` cannot be used, if so.

    The metadata is None if `path` is a single file, or if all files in the folder are taken without it.
    """
    if not path.is_dir():
        return None, [path], {}
    where = path / _METADATA
    found = sorted(each for each in path.iterdir() if each.suffix in _SUFFIXES and ".orig." not in each.name)
    packed = next((each for each in path.iterdir() if each.suffix in _PACKED), None)
    if packed and not found:
        raise BagError(f"{path}: {packed.name} is compressed with {packed.suffix[1:]}; decompress it first")
    if not where.exists():
        if not found:
            hint = f"; name its bags: {path / '*.bag'}" if any(path.glob("*.bag")) else ""
            raise BagError(f"{path} is a folder without {_METADATA} and without .mcap or .db3 files{hint}")
        return None, found, {}
    try:
        metadata, paths = _listed_files(path, where)
    except BagFormatError as error:
        if not found:
            raise
        return None, found, {os.fspath(where): f"{error}; all files in the folder are read instead"}
    if metadata.compression:
        raise BagError(
            f"{path}: its files or messages are compressed with {metadata.compression}; decompress them first"
        )
    return metadata, paths, {}


def _listed_files(path: Path, where: Path) -> tuple[BagMetadata, list[Path]]:
    """Return the metadata in the file `where`, and the files that it lists.

    Raises:
        BagFormatError: the metadata is malformed, or lists no file that exists.
    """
    try:
        text = read_text(os.fspath(where), process_limits().file_bytes)
    except UnicodeDecodeError as error:
        raise BagFormatError(f"{where}: {error}") from None
    except OSError as error:
        raise BagFormatError(f"{where}: {error.strerror or error}") from None
    metadata = parse_metadata(text, os.fspath(where))
    # Old versions of rosbag2 include the folder name in the paths.
    paths = list(dict.fromkeys(path / Path(name).name for name in metadata.files))
    if not any(each.exists() for each in paths) and not metadata.compression:
        raise BagFormatError(f"{where} lists no file that exists, but {', '.join(metadata.files) or 'none'}")
    return metadata, paths


def opened_files(paths: Sequence[Path]) -> tuple[dict[Path, StorageReader], dict[str, str]]:
    """Open the files of a bag. Return those that can be read, and the reasons for the others.

    Raises:
        BagError, OSError: no file can be read.
    """
    found: dict[Path, StorageReader] = {}
    skipped: dict[str, str] = {}
    failed: BagError | OSError | None = None
    for path in paths:
        try:
            check_no_pointer(path)
            found[path] = McapStorage(path) if is_mcap(path) else SqliteReader(path)
        except (BagError, OSError) as error:
            failed = error
            skipped[os.fspath(path)] = str(error)
    if not found and failed is not None:
        raise failed
    return found, skipped
