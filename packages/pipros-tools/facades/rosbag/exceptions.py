"""Exceptions of `rosbag`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pipros_tools.bag.errors import BagError, BagFormatError, ClosedBag, NotIndexed


class ROSBagException(Exception):
    """A bag cannot be read or written as requested.

    Attributes:
        value: the error text.
    """

    value: Any
    __module__ = "rosbag.bag"  # the module name in pickles written by genuine ROS

    def __init__(self, value: Any = None) -> None:
        self.value = value
        super().__init__(value)

    def __str__(self) -> str:
        return str(self.value)


class ROSBagFormatException(ROSBagException):
    """The bytes of a file violate the bag format."""

    __module__ = "rosbag.bag"  # the module name in pickles written by genuine ROS


class ROSBagUnindexedException(ROSBagException):
    """A bag has no readable index, for example because its writer was killed."""

    __module__ = "rosbag.bag"  # the module name in pickles written by genuine ROS

    def __init__(self, *_: Any) -> None:
        ROSBagException.__init__(self, "Unindexed bag")


class ROSBagEncryptNotSupportedException(ROSBagException):
    """Encrypted bags are not supported."""

    __module__ = "rosbag.bag"  # the module name in pickles written by genuine ROS


class ROSBagEncryptException(ROSBagException):
    """A bag cannot be encrypted or decrypted."""

    __module__ = "rosbag.bag"  # the module name in pickles written by genuine ROS


@contextmanager
def translated() -> Iterator[None]:
    """Translate pipros errors into the exceptions that users of rosbag catch."""
    try:
        yield
    except ClosedBag:  # a ValueError, as in genuine rosbag
        raise
    except NotIndexed as error:
        raise ROSBagUnindexedException() from error
    except BagFormatError as error:
        raise ROSBagFormatException(str(error)) from error
    except BagError as error:
        raise ROSBagException(str(error)) from error
