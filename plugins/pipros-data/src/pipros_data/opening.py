"""Open bags by their paths and patterns."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any

from pipros.basics.plugins import offered
from pipros_data.bags import BagPath, Bags
from pipros_tools.bag.opening import is_ros1_bag, open_bag
from pipros_tools.bag.reader import BagReader


def open_bags(*paths: BagPath | Iterable[BagPath], msgs: Sequence[BagPath] = ()) -> Bags:
    """Open bags, MCAP files and ROS 2 bags. Topics are read as if all files were a single bag.

    Args:
        paths: paths of bags, patterns such as `run*.bag`, or lists of them.
        msgs: folders with the message definitions for ROS 2 bags.

    Raises:
        BagError: a file is not a bag, or is damaged.
        FileNotFoundError: a path does not exist, or a pattern matches nothing.
        ValueError: there is no path, as in a list that `glob` returned.
    """
    readers: list[BagReader] = []
    each_path = list(_each_path(paths))
    if not each_path:
        raise ValueError("no bags to open: the list of paths is empty")
    try:
        for path in each_path:
            readers += [_opened(name, msgs) for name in matching_files(path)]
    except BaseException:
        for each in readers:
            each.close()
        raise
    return Bags(readers)


def _each_path(paths: Iterable[Any]) -> Iterator[BagPath]:
    for path in paths:
        if isinstance(path, str | os.PathLike):
            yield path
        elif isinstance(path, Iterable) and not isinstance(path, bytes) and not hasattr(path, "read"):
            yield from path
        else:
            raise TypeError(f"a bag must be named by its path, got {path!r}")


def matching_files(path: BagPath) -> list[str]:
    """Return the files that match a pattern. A path that exists or has no wildcards is returned as it is.

    Raises:
        FileNotFoundError: no file matches the pattern.
    """
    name = os.fspath(path)
    if os.path.exists(name) or not glob.has_magic(name):
        return [name]
    found = sorted(glob.glob(name, recursive=True))
    if not found:
        raise FileNotFoundError(2, "no such bag", name)
    return found


def _opened(path: str, folders: Sequence[BagPath]) -> BagReader:
    others = None if is_ros1_bag(path) else offered("bags")
    if others is None:
        return open_bag(path)
    found: BagReader = others.opened(path, SimpleNamespace(msgs=[os.fspath(each) for each in folders]))
    return found
