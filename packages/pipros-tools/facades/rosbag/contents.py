"""Methods that count and describe the contents of a `rosbag.Bag`."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Iterable

from pipros.basics.names import canonicalize
from pipros_tools.bag import compression as _compression
from pipros_tools.bag import info as _info
from pipros_tools.bag import info_text as _info_text
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError, NoMessages
from pipros_tools.bag.reader import BagReader
from rosbag.exceptions import ROSBagException, translated
from rosbag.results import CompressionTuple, TopicTuple, TypesAndTopicsTuple
from rospy.rostime import Time


def connections_on(bag: BagReader, topics: Iterable[str] | str) -> list[Connection]:
    """Return the connections on one topic or several. Repeated and trailing slashes do not count."""
    wanted = set(map(canonicalize, [topics] if isinstance(topics, str) else topics))
    return [each for each in bag.connections if canonicalize(each.topic) in wanted]


class BagContents(ABC):
    """Methods of `Bag` that count and describe its contents. They work in any mode."""

    _filename: str | None
    _skip_index: bool

    @abstractmethod
    def _view(self) -> BagReader:
        """Return a reader for the bag."""

    def __str__(self) -> str:
        with translated():
            return _info_text.info_text(self._info())

    def get_compression_info(self) -> CompressionTuple:
        """Return the chunks' most common compression format, and their total sizes in bytes.

        The uncompressed size comes first, then the compressed size.
        """
        with translated():
            found = _info.compressions(self._view())
        if not found:
            return CompressionTuple(_compression.NONE, 0, 0)
        sums = sum(each.uncompressed for each in found), sum(each.compressed for each in found)
        return CompressionTuple(found[0].name, *sums)

    def get_message_count(self, topic_filters: Iterable[str] | str | None = None) -> int:
        """Return the number of messages on the given topics, or on all topics by default."""
        bag = self._view()
        if topic_filters is None:
            return bag.message_count
        counts = bag.count_by_connection()
        return sum(counts[each.id] for each in connections_on(bag, topic_filters))

    def get_start_time(self) -> float:
        """Return the time of the first message in seconds. Raise `ROSBagException` if the bag is empty."""
        return self._range()[0].to_sec()

    def get_end_time(self) -> float:
        """Return the time of the last message in seconds. Raise `ROSBagException` if the bag is empty."""
        return self._range()[1].to_sec()

    def _range(self) -> list[Time]:
        try:
            return [Time(0, time_ns) for time_ns in self._view().range_ns]
        except NoMessages:
            raise ROSBagException("Bag contains no message") from None

    def get_type_and_topic_info(
        self, topic_filters: Iterable[str] | str | None = None
    ) -> TypesAndTopicsTuple:
        """Return the message types with their md5sums, and summaries of the topics.

        The types are always those of the whole bag. `topic_filters` selects the topics to summarize; by
        default, all topics are summarized.
        """
        bag = self._view()
        wanted = {each.topic for each in connections_on(bag, topic_filters)} if topic_filters else None
        with translated():
            topics = _info.topics(bag, wanted, with_frequencies=not self._skip_index)
        return TypesAndTopicsTuple(
            dict(sorted((connection.type, connection.md5sum) for connection in bag.connections)),
            {
                each.topic: TopicTuple(each.type, each.messages, each.connections, each.frequency)
                for each in topics
            },
        )

    def _get_yaml_info(self, key: str | None = None) -> str | None:
        """Return the output of `rosbag info --yaml`, or the part selected by `key`.

        If that part does not exist, print an error and return None.
        """
        with translated():
            info = self._info()
        if key is None:
            return _info_text.info_yaml(info)
        try:
            return _info_text.info_value(info, key)
        except BagError as error:
            print(error, file=sys.stderr)
            return None

    def _repr_html_(self) -> str:
        """Return a table of the topics as HTML, for notebooks."""
        return _info_text.info_html(self._info())

    def _info(self) -> _info.BagInfo:
        return _info.bag_info(self._view(), self._filename, with_frequencies=not self._skip_index)
