"""Read, write, index and repair bags (files of recorded messages). No node is needed.

    from pipros.bag import BagReader, BagWriter, merged, open_bag

The modules `records`, `index`, `compression` and `runs` perform no I/O. Bags and MCAP files are read through
`source.py`.
"""

from __future__ import annotations

from pipros.basics.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
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

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "BagError": "pipros.bag.errors",
        "BagFormatError": "pipros.bag.errors",
        "BagMessage": "pipros.bag.reader",
        "BagReader": "pipros.bag.reader",
        "BagWriter": "pipros.bag.writer",
        "Connection": "pipros.bag.connection",
        "NoMessages": "pipros.bag.errors",
        "NotIndexed": "pipros.bag.errors",
        "TopicWriter": "pipros.bag.topic_writer",
        "merged": "pipros.bag.merge",
        "open_bag": "pipros.bag.opening",
    },
)
