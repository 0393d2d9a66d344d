"""`rosbag` for Python code: recorded messages in files.

Facade of `pipros.bag`; see http://wiki.ros.org/rosbag/Code%20API.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.cli.rosbag import main as _main
from rosbag.bag import (
    Bag,
    BagMessage,
    BagMessageWithConnectionHeader,
    Compression,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
)

__all__ = [
    "Bag",
    "BagMessage",
    "BagMessageWithConnectionHeader",
    "Compression",
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "rosbagmain",
]


def rosbagmain(argv: Sequence[str] | None = None) -> None:
    """The command `rosbag`; `argv` has its name first. Ends the process with its exit code."""
    sys.exit(_main(list(sys.argv if argv is None else argv)[1:]))
