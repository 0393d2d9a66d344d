"""Read, write, index and repair bags (files of recorded messages). No node is needed.

    from pipros.bag import BagReader, BagWriter, merged, open_bag

Records, index, compression and the order of messages are pure: bytes in, values out. Files are read through
`source.py` alone.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from pipros.bag.connection import Connection
    from pipros.bag.errors import BagError, BagFormatError, NoMessages, NotIndexed
    from pipros.bag.merge import merged
    from pipros.bag.opening import open_bag
    from pipros.bag.reader import BagMessage, BagReader
    from pipros.bag.topic_writer import TopicWriter
    from pipros.bag.writer import BagWriter

__all__ = [
    "BagError",
    "BagFormatError",
    "BagMessage",
    "BagReader",
    "BagWriter",
    "Connection",
    "NoMessages",
    "NotIndexed",
    "TopicWriter",
    "merged",
    "open_bag",
]

_HOMES = {
    "BagMessage": "reader",
    "BagReader": "reader",
    "BagWriter": "writer",
    "Connection": "connection",
    "TopicWriter": "topic_writer",
    "merged": "merge",
    "open_bag": "opening",
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES.get(name, 'errors')}"), name)
