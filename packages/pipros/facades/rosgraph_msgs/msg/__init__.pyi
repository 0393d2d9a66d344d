"""Messages of rosgraph_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import time as _time
import std_msgs.msg

class Clock(_base.Message):
    """Simulated time, which a simulator or rosbag play publishes on /clock. Nodes use it if use_sim_time is true
    when they start."""
    clock: _time.Time
    """the current time, in seconds and nanoseconds"""
    def __init__(self, clock: _time.Time | None = ...) -> None: ...

class Log(_base.Message):
    """A line of a node's log. Nodes publish on /rosout; the node rosout collects these and publishes /rosout_agg."""
    DEBUG: _Final = 1
    """of interest to developers"""
    INFO: _Final = 2
    """normal events"""
    WARN: _Final = 4
    """something is unusual; the node continues"""
    ERROR: _Final = 8
    """something failed"""
    FATAL: _Final = 16
    """the node cannot continue"""
    header: std_msgs.msg.Header
    """stamp: when the line was logged; frame_id is not used"""
    level: int
    """DEBUG, INFO, WARN, ERROR or FATAL"""
    name: str
    """the node, such as /talker"""
    msg: str
    """the logged text"""
    file: str
    """the source file; may be empty"""
    function: str
    """the function in it; may be empty"""
    line: int
    """the line in it; 0: unknown"""
    topics: list[str]
    """topics that the node publishes; may be empty"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., level: int | None = ..., name: str | None = ..., msg: str | None = ..., file: str | None = ..., function: str | None = ..., line: int | None = ..., topics: list[str] | None = ...) -> None: ...

class TopicStatistics(_base.Message):
    """Statistics of one subscriber about the messages from one publisher of a topic, over a window of time.
    Subscribers publish them on /statistics while the parameter enable_statistics is true."""
    topic: str
    """the topic"""
    node_pub: str
    """the node that publishes it"""
    node_sub: str
    """the node that subscribes to it, and publishes these statistics"""
    window_start: _time.Time
    """beginning of the window"""
    window_stop: _time.Time
    """end of the window"""
    delivered_msgs: int
    """messages that arrived"""
    dropped_msgs: int
    """messages that were lost before they reached the callback"""
    traffic: int
    """bytes that arrived"""
    period_mean: _time.Duration
    """time from one message to the next: mean"""
    period_stddev: _time.Duration
    """time from one message to the next: standard deviation"""
    period_max: _time.Duration
    """time from one message to the next: longest"""
    stamp_age_mean: _time.Duration
    """age by header.stamp on arrival: mean; 0 for messages without a header"""
    stamp_age_stddev: _time.Duration
    """age by header.stamp on arrival: standard deviation"""
    stamp_age_max: _time.Duration
    """age by header.stamp on arrival: oldest"""
    def __init__(self, topic: str | None = ..., node_pub: str | None = ..., node_sub: str | None = ..., window_start: _time.Time | None = ..., window_stop: _time.Time | None = ..., delivered_msgs: int | None = ..., dropped_msgs: int | None = ..., traffic: int | None = ..., period_mean: _time.Duration | None = ..., period_stddev: _time.Duration | None = ..., period_max: _time.Duration | None = ..., stamp_age_mean: _time.Duration | None = ..., stamp_age_stddev: _time.Duration | None = ..., stamp_age_max: _time.Duration | None = ...) -> None: ...
