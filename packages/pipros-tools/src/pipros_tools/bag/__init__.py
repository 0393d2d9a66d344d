"""Read, write, index and repair bags (files of recorded messages). No node is needed.

    from pipros_tools.bag import BagReader, BagWriter, merged, open_bag

The modules `records`, `index`, `compression` and `runs` perform no I/O. Bags and MCAP files are read through
`source.py`.
"""

from __future__ import annotations

from pipros.basics.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pipros_tools.bag.connection import Connection
    from pipros_tools.bag.errors import BagError, BagFormatError, NoMessages, NotIndexed
    from pipros_tools.bag.merge import merged
    from pipros_tools.bag.opening import open_bag
    from pipros_tools.bag.reader import BagMessage, BagReader
    from pipros_tools.bag.topic_writer import TopicWriter
    from pipros_tools.bag.writer import BagWriter

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
        "BagError": "pipros_tools.bag.errors",
        "BagFormatError": "pipros_tools.bag.errors",
        "BagMessage": "pipros_tools.bag.reader",
        "BagReader": "pipros_tools.bag.reader",
        "BagWriter": "pipros_tools.bag.writer",
        "Connection": "pipros_tools.bag.connection",
        "NoMessages": "pipros_tools.bag.errors",
        "NotIndexed": "pipros_tools.bag.errors",
        "TopicWriter": "pipros_tools.bag.topic_writer",
        "merged": "pipros_tools.bag.merge",
        "open_bag": "pipros_tools.bag.opening",
    },
)
