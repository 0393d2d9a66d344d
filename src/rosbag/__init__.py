"""`rosbag` for Python code: recorded messages in files.

Facade of `pipros.bag`; see http://wiki.ros.org/rosbag/Code%20API.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.cli.rosbag import main as _main
from pipros.lazy_names import star_names as _star_names
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

_star_names(
    __name__,
    "rosbag.bag rosbag.migration rosbag.rosbag_main",
    hidden=(
        "BagMessage BagMessageWithConnectionHeader ROSBagEncryptException ROSBagEncryptNotSupportedException"
    ),
)


def rosbagmain(argv: Sequence[str] | None = None) -> None:
    """The command `rosbag`; `argv` has its name first. Ends the process with its exit code."""
    sys.exit(_main(list(sys.argv if argv is None else argv)[1:]))
