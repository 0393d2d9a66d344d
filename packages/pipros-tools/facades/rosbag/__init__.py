"""Drop-in replacement for Noetic's `rosbag`: read and write bags.

Facade of `pipros_tools.bag`; see http://wiki.ros.org/rosbag/Code%20API.
"""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
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
from rosbag.rosbag_main import rosbagmain

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
