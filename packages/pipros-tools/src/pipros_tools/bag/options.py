"""Options of recording and playing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from pipros_tools.bag.writer import CHUNK_BYTES


@dataclass(frozen=True, slots=True)
class FileOptions:
    """Options for the names, sizes and number of a recording's files.

    Attributes:
        prefix: prefix of the file name; the date is appended.
        name: the file name, used instead of `prefix` and the date.
        split: whether to start a new file when `size_bytes` or `duration_s` is reached. If False, the
            recording ends.
        max_splits: maximum number of files kept; 0 for no limit.
        size_bytes, duration_s: limits on one file; 0 for no limit.
        repeat_latched: whether each file after the first starts with the latched messages.
    """

    prefix: str = ""
    name: str = ""
    split: bool = False
    max_splits: int = 0
    size_bytes: int = 0
    duration_s: float = 0.0
    compression: str = "none"
    chunk_bytes: int = CHUNK_BYTES
    repeat_latched: bool = False


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """Options for a recording.

    Attributes:
        topics: topic names, or regular expressions if `is_regex`.
        all: whether to record all topics.
        exclude: regular expression that matches the topics to skip.
        of_node: name of a node whose subscribed topics are recorded.
        limit: maximum number of messages per topic; 0 for no limit.
        buffer_bytes: maximum size of the queue of unwritten messages; 0 for no limit.
        min_space_bytes: free disk space below which writing is paused.
        ends_without_space: whether the recording ends, instead of pausing, when disk space runs low.
        publish: whether to publish the name of each file on `begin_write`.
        snapshot: whether to keep messages in memory, and write them only on request: a message on
            `snapshot_trigger`, or a call to the service `~trigger_snapshot`; see `Snapshots`. `buffer_bytes`
            and the files' `duration_s` limit the messages kept.
    """

    topics: Sequence[str] = ()
    all: bool = False
    is_regex: bool = False
    exclude: str = ""
    of_node: str = ""
    limit: int = 0
    buffer_bytes: int = 256 * 1024 * 1024
    min_space_bytes: int = 1024**3
    ends_without_space: bool = False
    tcp_nodelay: bool = False
    publish: bool = False
    snapshot: bool = False
    files: FileOptions = field(default_factory=FileOptions)


@dataclass(frozen=True, slots=True)
class PlayOptions:
    """Options for playback, which correspond to the options of `rosbag play`.

    Attributes:
        duration_s: maximum duration to play, in seconds; None for no limit.
        skip_empty_s: duration in seconds; longer gaps between messages are skipped. None to play all gaps.
        topics: topics to play; empty for all.
        pause_topics: playback pauses after each message on these topics.
        rate_control_topic: playback pauses while the last message on this topic is older than
            `rate_control_delay_s`; empty to disable this.
    """

    prefix: str = ""
    immediate: bool = False
    paused: bool = False
    queue_size: int = 100
    clock: bool = False
    clock_hz: float = 100.0
    delay_s: float = 0.2
    rate: float = 1.0
    start_s: float = 0.0
    duration_s: float | None = None
    skip_empty_s: float | None = None
    loop: bool = False
    keep_alive: bool = False
    topics: Sequence[str] = ()
    pause_topics: Sequence[str] = ()
    wait_for_subscribers: bool = False
    rate_control_topic: str = ""
    rate_control_delay_s: float = 1.0
