"""Drop-in replacement for `rosbag.Bag`.

Facade of `pipros_tools.bag`; see http://wiki.ros.org/rosbag/Code%20API.
"""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial as _partial
from typing import Any

from pipros.basics.input_file import open_file as _open_file
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.planted import open_unplanted as _open_unplanted
from pipros.msg.time import NS_PER_S as _NS_PER_S
from pipros.msg.time import Time as _Time
from pipros_tools.bag import compression as _compression
from pipros_tools.bag.bag_file import BagFile
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.writer import CHUNK_BYTES
from rosbag.exceptions import (
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
    translated,
)
from rosbag.index_access import ConnectionFilter, IndexAccess
from rosbag.index_access import ConnectionInfo as _ConnectionInfo
from rosbag.results import BagMessage, BagMessageWithConnectionHeader
from rospy.rostime import Time

_OPENERS: dict[str, Callable[[Any], Any]] = {
    "r": _open_file,
    "w": _partial(open, mode="w+b", opener=_open_unplanted),
    "a": _partial(open, mode="r+b", opener=_open_unplanted),
}

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
]

_star_names(
    __name__,
    "bisect bz2 collections Cryptodome.Cipher.AES genmsg genpy get_random_bytes=os:urandom gnupg heapq os "
    "re roslib rospy StringIO=io:BytesIO struct sys threading time yaml",
)


class Compression:
    """Names of the chunk compression formats."""

    NONE = _compression.NONE
    BZ2 = _compression.BZ2
    LZ4 = _compression.LZ4


class Bag(IndexAccess):
    """A bag file, open for reading, writing or appending.

    Threads and forked processes may share a bag that is open for reading, if each uses its own iterators. If
    it was opened by its path, it can be pickled: the copy opens the file again. Otherwise, a bag is not
    thread-safe.

    Unlike in genuine rosbag, messages are always read in time order, even if written out of order; each
    combination of topic, type and connection header gets its own connection; and the bag can be read while
    it is written.

    Args:
        f: a path, or a seekable binary file, which `close` also closes.
        mode: `r`, `w` or `a`.
        compression: compression of written chunks: `none`, `bz2` or `lz4`.
        chunk_threshold: uncompressed size of written chunks, in bytes.
        allow_unindexed: whether to open a bag without an index as an empty bag, for `reindex`.
        options: a dictionary with `compression` and `chunk_threshold`, which override the arguments.
        skip_index: whether to skip reading the chunk indexes. The topic frequencies are then unknown.

    Raises:
        ValueError: an argument is invalid.
        ROSBagException: the file is not a bag.
        ROSBagUnindexedException: the bag has no readable index.
    """

    def __init__(
        self,
        f: Any,
        mode: str = "r",
        compression: str = Compression.NONE,
        chunk_threshold: int = CHUNK_BYTES,
        allow_unindexed: bool = False,
        options: Mapping[str, Any] | None = None,
        skip_index: bool = False,
    ) -> None:
        if options is not None:
            if not isinstance(options, dict):
                raise ValueError("options must be of type dict")
            compression = options.get("compression", compression)
            chunk_threshold = options.get("chunk_threshold", chunk_threshold)
        self._file: Any = None
        self._filename: str | None = None
        self._bag: BagFile | None = None
        self._skip_index = skip_index
        _check_compression(compression)
        _check_chunk_threshold(chunk_threshold)
        self._compression, self._chunk_threshold = compression, chunk_threshold
        if not f:
            raise ValueError("filename (or stream) is invalid")
        if mode not in ("r", "w", "a"):
            raise ValueError(f'mode "{mode}" is invalid')
        self._mode = mode
        self._allows_unindexed = allow_unindexed
        self._open(f, allow_unindexed)

    def __reduce__(self) -> tuple[Any, ...]:
        self._opened()
        if self._mode != "r" or self._filename is None:
            raise TypeError("only a bag that was opened by its path, for reading, can be pickled")
        more = self._compression, self._chunk_threshold, self._allows_unindexed, None, self._skip_index
        return type(self), (os.path.abspath(self._filename), "r", *more)

    def _open(self, f: Any, allow_unindexed: bool) -> None:
        if isinstance(f, str | os.PathLike):
            self._filename = os.fspath(f)
            if self._mode == "a" and not os.path.exists(f):
                raise ROSBagException("empty file")
            self._file = _OPENERS[self._mode](f)
        else:
            self._file = f
        try:
            with translated():
                self._bag = BagFile(
                    self._file,
                    self._filename or str(getattr(self._file, "name", "<bag>")),
                    self._mode,
                    compression=self._compression,
                    chunk_bytes=self._chunk_threshold,
                    allow_unindexed=allow_unindexed,
                )
        except BaseException:
            if self._filename is not None:
                self._file.close()
            raise
        self._version = self._bag.version

    def __iter__(self) -> Iterator[BagMessage]:
        return self.read_messages()

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, exc_type: object, exc_value: object, traceback: object) -> None:
        self.close()

    @property
    def options(self) -> dict[str, Any]:
        """The options used for written chunks, as a dictionary."""
        return {"compression": self._compression, "chunk_threshold": self._chunk_threshold}

    @property
    def filename(self) -> str | None:
        """Path of the file, or None if the bag was opened with a file object."""
        return self._filename

    @property
    def version(self) -> int:
        """Format version: 200 for 2.0."""
        return self._version

    @property
    def mode(self) -> str:
        """`r`, `w` or `a`."""
        return self._mode

    @property
    def size(self) -> int:
        """Size of the file in bytes."""
        return self._opened().size

    @property
    def compression(self) -> str:
        """Compression of written chunks."""
        return self._compression

    @compression.setter
    def compression(self, compression: str) -> None:
        _check_compression(compression)
        with translated():
            self._opened().set_chunks(compression, self._chunk_threshold)
        self._compression = compression

    @property
    def chunk_threshold(self) -> int:
        """Uncompressed size of written chunks, in bytes."""
        return self._chunk_threshold

    @chunk_threshold.setter
    def chunk_threshold(self, chunk_threshold: int) -> None:
        _check_chunk_threshold(chunk_threshold)
        with translated():
            self._opened().set_chunks(self._compression, chunk_threshold)
        self._chunk_threshold = chunk_threshold

    def set_encryptor(self, encryptor: str | None = None, param: Any = None) -> None:
        """Do nothing if `encryptor` is empty or `rosbag/NoEncryptor`; encryption is not supported.

        Raises:
            ROSBagEncryptNotSupportedException: another encryptor was given.
        """
        del param
        if encryptor not in (None, "", "rosbag/NoEncryptor"):
            raise ROSBagEncryptNotSupportedException(
                f"encryption is not supported, got encryptor [{encryptor}]"
            )

    def read_messages(
        self,
        topics: Iterable[str] | str | None = None,
        start_time: _Time | None = None,
        end_time: _Time | None = None,
        connection_filter: ConnectionFilter | None = None,
        raw: bool = False,
        return_connection_header: bool = False,
    ) -> Iterator[Any]:
        """Return an iterator over messages in time order.

        Args:
            topics: one topic or several. If empty or None, all topics are read.
            start_time, end_time: first and last timestamp, inclusive. None and 0 mean no limit.
            connection_filter: called with the topic, type, md5sum, definition and header of each connection;
                returns whether to read its messages.
            raw: yield (type, serialized message, md5sum, position, class) instead of the message.
            return_connection_header: yield `BagMessageWithConnectionHeader` instead of `BagMessage`.

        Raises:
            ROSBagException: the bag is damaged, or does not contain a valid definition for a type.
            TypeError: a time is not a `rospy.Time`.
        """
        bag = self._view()
        connections = self._chosen(bag, topics, connection_filter)
        times = _ns("start_time", start_time), _ns("end_time", end_time)
        found = self._raw(bag, connections, *times) if raw else bag.decoded(connections, *times)
        return _results(found, return_connection_header)

    def _raw(
        self, bag: BagReader, connections: list[Connection], *times: int | None
    ) -> Iterator[tuple[Connection, int, Any]]:
        """Yield messages like `BagReader.decoded`, but as the tuples of `read_messages(raw=True)`."""
        classes: dict[int, Any] = {}
        is_chunked = self._version == 200
        for connection, time_ns, data, chunk, offset in bag.placed_fields(connections, *times):
            cls = classes.get(connection.id)
            if cls is None:
                cls = classes[connection.id] = bag.class_of(connection)
            position = (chunk, offset) if is_chunked else chunk + offset
            yield connection, time_ns, (connection.type, data, connection.md5sum, position, cls)

    def write(
        self,
        topic: str,
        msg: Any,
        t: _Time | None = None,
        raw: bool = False,
        connection_header: Mapping[str, Any] | None = None,
    ) -> None:
        """Add a message.

        Args:
            msg: a message. If `raw` is true, the tuple (type, serialized message, md5sum, class), or (type,
                serialized message, md5sum, position, class) as yielded by `read_messages`.
            t: time of receipt; defaults to the current time.
            connection_header: connection header of the publisher.

        Raises:
            ValueError: an argument is invalid, or the bag is closed.
            TypeError: `t` is not a `rospy.Time`.
            genpy.SerializationError: a value does not fit its field.
            ROSBagException: the message is raw, and no definition of its type is available.
            io.UnsupportedOperation: the bag was opened for reading.
        """
        bag = self._opened()
        if not topic:
            raise ValueError("topic is invalid")
        if not msg:
            raise ValueError("msg is invalid")
        if bag.topics is None:
            raise io.UnsupportedOperation("write")
        if t is None:
            t = Time.from_sec(time.time())
        elif not isinstance(t, _Time):
            raise TypeError(f"t must be a rospy.Time, got {t!r}")
        with translated():
            if not raw:
                bag.topics.write(topic, msg, t.secs, t.nsecs, connection_header)
                return
            type_name, data, md5sum, cls = _raw_parts(msg)
            bag.topics.write_raw(topic, type_name, md5sum, data, t.secs, t.nsecs, connection_header, cls)

    def _write_connection_record(self, connection_info: _ConnectionInfo, encrypt: bool = True) -> None:
        """Add a connection, unless the topic has one with the same header."""
        del encrypt
        topics, info = self._opened().topics, connection_info
        if topics is None:
            raise io.UnsupportedOperation("write")
        with translated():
            topics.connection_of(info.topic, (info.datatype, info.md5sum), info.header, None)

    def flush(self) -> None:
        """Write the messages added since the last flush to the file, as a chunk."""
        with translated():
            self._opened().flush()

    def reindex(self) -> Iterator[int]:
        """Rebuild the index of a bag opened with `allow_unindexed`. `close` writes it, but not in mode `r`.

        Return an iterator over the chunk positions, for progress displays.

        Raises:
            ROSBagException: the format does not support an index.
        """
        self._clear_index()
        with translated():
            return iter(self._opened().reindex())

    def close(self) -> None:
        """Write the index and close the file. May be called repeatedly."""
        if self._bag is None:
            return
        file, bag = self._file, self._bag
        try:
            with translated():
                bag.finish()
        finally:
            self._file = self._bag = None
            self._clear_index()
            file.close()

    def _view(self) -> BagReader:
        with translated():
            return self._opened().view()

    def _opened(self) -> BagFile:
        if self._bag is None:
            raise ValueError("I/O operation on closed bag")
        return self._bag


def _check_compression(compression: str) -> None:
    if compression not in _compression.COMPRESSIONS:
        raise ValueError(f"compression must be one of: {', '.join(_compression.COMPRESSIONS)}")


def _raw_parts(msg: Any) -> tuple[str, bytes, str, Any]:
    if len(msg) not in (4, 5):
        raise ValueError("msg must be of length 4 or 5")
    return msg[0], bytes(msg[1]), msg[2], msg[-1]


def _check_chunk_threshold(chunk_threshold: int) -> None:
    if chunk_threshold < 0:
        raise ValueError("chunk_threshold must be greater than or equal to zero")


def _ns(name: str, time: _Time | None) -> int | None:
    if not time:  # zero means no limit, as in genuine rosbag
        return None
    if not hasattr(time, "secs"):
        raise TypeError(f"{name} must be a rospy.Time, got {time!r}")
    return time.secs * _NS_PER_S + time.nsecs


def _results(found: Iterator[tuple[Connection, int, Any]], with_header: bool) -> Iterator[Any]:
    """Yield `BagMessage`s without calling the constructor, which would take most of the time."""
    new_time, new = Time.__new__, tuple.__new__
    with translated():
        for connection, time_ns, message in found:
            stamp = new_time(Time)
            stamp.secs, stamp.nsecs = divmod(time_ns, _NS_PER_S)
            if with_header:
                yield BagMessageWithConnectionHeader(connection.topic, message, stamp, connection.header)
            else:
                yield new(BagMessage, (connection.topic, message, stamp))
