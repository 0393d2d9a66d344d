"""Subscribe to the selected topics as they appear, and write their messages to files."""

from __future__ import annotations

import re
import shutil
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import listed
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros_tools.bag.connection import Connection, StoredMessage, received_connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.options import FileOptions, RecordOptions
from pipros_tools.bag.record_files import RecordFiles
from pipros_tools.bag.record_queue import RecordQueue

if TYPE_CHECKING:
    from pipros.basics.printable import Say


_POLL_PERIOD_S = 0.5
"""Interval between polls of the master for new topics."""
KEPT_CONNECTIONS = 1000
"""Maximum number of cached connections per topic."""

_WAIT_S = 0.2
_DISK_PERIOD_S = 5.0
_ENDING_DISK_PERIOD_S = 0.5
_CHUNK_AGE_S = 1.0
"""Maximum age of messages that are not in the file yet: what a killed recording loses, beside a slow disk."""


class Recorder:
    """A recording made by a node.

    Args:
        say, warn: called with a line of text to show.

    Attributes:
        written: number of messages written so far.

    Raises:
        BagError: a regular expression is malformed.
    """

    def __init__(self, node: Node, options: RecordOptions, *, say: Say, warn: Say) -> None:
        self._node = node
        self._options = options
        self._say = say
        self._warn = warn
        kept_ns = round(options.files.duration_s * NS_PER_S) if options.snapshot else 0
        self._queue = RecordQueue(options.buffer_bytes, kept_ns)
        self._snapshots = Snapshots(options.files, self._queue, say)
        self._subscribers: dict[str, Any] = {}
        self.written = 0
        self._left: dict[str, int] = {}
        self._finds_topics = options.all or options.is_regex or bool(options.of_node)
        self._wanted = [_compiled(topic) for topic in options.topics] if options.is_regex else []
        self._exclude = _compiled(options.exclude) if options.exclude else None
        self._reported_dropped = 0
        self._has_space = True
        self._is_full = False
        self._started_ns = 0
        self._next_poll = self._next_disk_check = 0.0
        self._next_flush = time.monotonic() + _CHUNK_AGE_S

    @property
    def topics(self) -> int:
        """Number of subscribed topics."""
        return len(self._subscribers)

    def run(self) -> bool:
        """Record until the node shuts down, or until the recording is complete.

        Return False if the last file could not be completed, or messages were discarded to complete it.

        Raises:
            OSError: the first file cannot be created.
        """
        if not self._options.snapshot:  # which would keep what arrives before the first time
            self._subscribe_to_named()
        self._node.clock.sleep(0.0)  # until simulated time starts, so that no bag starts at 0
        self._started_ns = self._node.clock.now_ns()
        if not self._started_ns:
            self._warn("no bag was written: the recording ended before a time later than 0 arrived on /clock")
            return True
        if self._options.snapshot:
            self._run_snapshots()
            return True
        files = RecordFiles(self._options.files, self._say, self._announcer())
        files.open(self._started_ns)
        self._node.on_shutdown(self._queue.close)
        try:
            while not self._node.is_shutdown and not self._is_complete():
                self._poll_master_and_disk(files)
                if self._options.ends_without_space and not self._has_space:
                    break
                if not self._write_all(files, self._queue.get_all(_WAIT_S)):
                    break
                if files.is_due(self._node.clock.now_ns()) and not self._options.files.split:
                    break
            self._queue.close()
            self._write_all(files, self._queue.get_all(0.0))
        finally:
            is_complete = self._close(files)
            self._report_dropped()
        return is_complete

    def _subscribe_to_named(self) -> None:
        named = () if self._options.is_regex else self._options.topics
        for topic in dict.fromkeys(map(self._node.resolve, named)):
            self._subscribe(topic)

    def _run_snapshots(self) -> None:
        from pipros.msg import load_message_class, load_service_class

        announce = self._announcer()
        answer = load_service_class("std_srvs/Trigger")

        def write(_: object) -> Any:
            try:
                path, count = self._snapshots.write(self._node.clock.now_ns())
            except (OSError, BagError) as error:
                self._warn(f"cannot write a snapshot: {error}")
                return answer._response_class(False, str(error))
            self._say(f"Wrote a snapshot of {count} messages to '{path}'.")
            announce(str(path))
            return answer._response_class(True, str(path))

        self._subscribe_to_named()
        self._node.subscribe("snapshot_trigger", load_message_class("std_msgs/Empty"), write)
        self._node.serve("~trigger_snapshot", answer, write)
        self._say("Waiting for a message on snapshot_trigger, or a call to ~trigger_snapshot.")
        while not self._node.is_shutdown:
            if self._finds_topics:
                self._poll_master()
            self._node.wait_for_shutdown(_POLL_PERIOD_S)

    def _close(self, files: RecordFiles) -> bool:
        before = files.lost
        try:
            files.close()
        except OSError as error:
            rest = f"Its complete chunks stay in '{files.path}.active', which rosbag reindex can repair"
            is_gone = isinstance(error, FileNotFoundError)
            self._warn(f"cannot complete '{files.path}': {error.strerror}{'' if is_gone else f'. {rest}'}")
            return False
        if files.lost > before:
            self._warn(
                f"the disk with '{files.path}' is full: "
                f"the last {files.lost - before} messages were discarded to complete the file"
            )
        return files.lost == before

    def _announcer(self) -> Say:
        if not self._options.publish:
            return lambda _: None
        from pipros.msg import load_message_class

        text = load_message_class("std_msgs/String")
        publisher: Any = self._node.advertise("begin_write", text, latch=True)
        return lambda name: publisher.publish(text(name))

    def _poll_master_and_disk(self, files: RecordFiles) -> None:
        now = time.monotonic()
        if self._finds_topics and now >= self._next_poll:
            self._next_poll = now + _POLL_PERIOD_S
            self._poll_master()
        if now >= self._next_disk_check:
            ends = self._options.ends_without_space
            self._next_disk_check = now + (_ENDING_DISK_PERIOD_S if ends else _DISK_PERIOD_S)
            self._report_dropped()  # uses `_has_space`, which `_check_disk` changes
            self._check_disk(files)

        if now >= self._next_flush and self._has_space:
            self._next_flush = now + _CHUNK_AGE_S
            try:
                files.flush()
            except OSError as error:
                self._pause(files, error)

    def _poll_master(self) -> None:
        try:
            self._find_topics()
        except (PiprosError, OSError) as error:
            self._warn(f"cannot reach the master: {error}")

    def _pause(self, files: RecordFiles, error: OSError) -> None:
        self._has_space, self._is_full = False, True
        self._warn(
            f"cannot write to '{files.path}': {error.strerror}. Recording resumes when writing succeeds"
        )

    def _find_topics(self) -> None:
        if self._options.of_node:
            node = self._node.resolve(self._options.of_node)
            _, subscribers, _ = self._node.master.get_system_state()
            found = [str(topic) for topic, nodes in subscribers if node in nodes]
        else:
            found = [topic for topic, _ in self._node.master.get_published_topics()]
        for topic in found:
            if topic not in self._subscribers and self._is_wanted(topic):
                self._subscribe(topic)

    def _is_wanted(self, topic: str) -> bool:
        if self._exclude is not None and self._exclude.fullmatch(topic):
            return False
        return not self._wanted or any(each.fullmatch(topic) for each in self._wanted)

    def _subscribe(self, topic: str) -> None:
        self._say(f"Subscribing to {listed(topic)}")
        self._left[topic] = self._options.limit
        self._subscribers[topic] = self._node.subscribe(
            topic, AnyMsg, self._callback_for(topic), tcp_nodelay=self._options.tcp_nodelay
        )

    def _callback_for(self, topic: str) -> Callable[[AnyMsg], None]:
        now_ns = self._node.clock.now_ns
        put = self._snapshots.put if self._options.snapshot else self._queue.put
        # Connections are keyed by the `id` of the publisher's header. The `id` is unique as long as the
        # header is referenced, so the cache keeps a reference.
        connections: dict[int, tuple[Connection, Mapping[str, str]]] = {}

        def put_received(message: AnyMsg) -> None:
            header = message.header
            known = connections.get(id(header))
            if known is None:
                # When the cache is full, most of its headers belong to publishers that no longer exist.
                if len(connections) >= KEPT_CONNECTIONS:
                    connections.clear()
                known = connections[id(header)] = received_connection(topic, header), header
            put(StoredMessage(known[0], now_ns(), message.body))

        return put_received

    def _is_complete(self) -> bool:
        return bool(self._options.limit and self._left) and not any(self._left.values())

    def _write_all(self, files: RecordFiles, messages: list[StoredMessage]) -> bool:
        """Write the messages. Return False if the recording is complete."""
        for message in messages:
            if self._options.limit:
                topic = message.connection.topic
                if not self._left[topic]:
                    continue
                self._left[topic] -= 1
            if not self._has_space:
                self._queue.dropped += 1
                continue
            if not message.time_ns:  # it arrived before the first simulated time
                message = message._replace(time_ns=self._started_ns)
            try:
                if not files.write(message):
                    return False
                self.written += 1
            except OSError as error:
                self._queue.dropped += 1
                self._pause(files, error)
        return True

    def _check_disk(self, files: RecordFiles) -> None:
        free = shutil.disk_usage(files.path.absolute().parent).free
        had_space, self._has_space = self._has_space, free >= self._options.min_space_bytes
        self._is_full = self._is_full and not self._has_space
        if had_space and not self._has_space:
            self._warn(
                f"Less than {self._options.min_space_bytes} bytes of space free on disk with "
                f"'{files.path}'. "
                + ("The recording ends." if self._options.ends_without_space else "Disabling recording.")
            )
        elif self._has_space and not had_space:
            self._say("Re-enabling recording.")

    def _report_dropped(self) -> None:
        if self._queue.dropped > self._reported_dropped:
            self._warn(
                f"{self._queue.dropped - self._reported_dropped} messages were dropped, "
                f"{self._queue.dropped} in all: "
                + (
                    "the disk or the compression does not keep up (see --buffsize)"
                    if self._has_space
                    else "the disk is full"
                    if self._is_full
                    else f"less than {self._options.min_space_bytes} bytes are free (see --min-space)"
                )
            )
            self._reported_dropped = self._queue.dropped


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        return re.compile(pattern)
    except re.error as error:
        raise BagError(f"[{pattern}] is not a regular expression: {error}") from None


class Snapshots:
    """Writer that moves queued messages to files. Thread-safe.

    Args:
        options: options for the files. If `repeat_latched` is true, a file starts with the latched messages
            that are no longer in the queue. Existing files are never replaced; instead, a number is appended
            to the name.
        say: called with a line of text when a file is opened.
    """

    def __init__(self, options: FileOptions, queue: RecordQueue, say: Say) -> None:
        self._options = replace(options, split=False, size_bytes=0, duration_s=0.0, repeat_latched=False)
        self._keeps_latched = options.repeat_latched
        self._queue = queue
        self._say = say
        self._latched: dict[tuple[str, str], StoredMessage] = {}
        self._lock = threading.Lock()

    def put(self, message: StoredMessage) -> None:
        """Add a message to the queue."""
        connection = message.connection
        if self._keeps_latched and connection.is_latching:
            self._latched[connection.topic, connection.callerid] = message
        self._queue.put(message)

    def write(self, now_ns: int) -> tuple[Path, int]:
        """Write a file, and return its path and the number of messages in it.

        Raises:
            BagError: there are no messages.
            OSError: the file cannot be written. The messages are lost.
        """
        with self._lock:
            messages = self._queue.get_all(0.0)
            kept = {id(message) for message in messages}
            start_ns = messages[0].time_ns if messages else now_ns
            first = [
                message._replace(time_ns=start_ns)
                for message in list(self._latched.values())
                if id(message) not in kept
            ]
            if not messages and not first:
                raise BagError("there are no messages for a snapshot")
            files = RecordFiles(self._options, self._say, avoid_existing=True)
            files.open(start_ns)
            try:
                for message in (*first, *messages):
                    files.write(message)
            finally:
                files.close()
        return files.path, len(first) + len(messages) - files.lost
