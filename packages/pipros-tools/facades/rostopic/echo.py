"""Python API for the output of `rostopic echo`."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from pipros.msg.base import Message
from pipros.msg.text import strify_message
from pipros_tools.graph.elide import Elision
from pipros_tools.graph.message_path import Part
from pipros_tools.graph.message_rows import FieldFilter, MessageRows, field_filter

CLEAR_SCREEN = "\x1b[2J\x1b[;H"

ValueTransform = Callable[..., Any]


def create_field_filter(echo_nostr: bool, echo_noarr: bool) -> FieldFilter:
    """Return a function that selects the fields to print, given a message.

    It omits strings if `echo_nostr` is true, and arrays if `echo_noarr` is true.
    """
    return field_filter(no_arrays=echo_noarr, no_texts=echo_nostr)


def create_value_transform(echo_nostr: bool, echo_noarr: bool) -> ValueTransform:
    """Return a function that replaces values in a message with their sizes.

    It replaces strings if `echo_nostr` is true, and arrays if `echo_noarr` is true.
    """
    elision = Elision(no_arrays=echo_noarr, no_texts=echo_nostr)

    def value_transform(val: Any, type_information: str | None = None) -> Any:
        return elision.of(Part(val, type_information))

    return value_transform


class CallbackEcho:
    """Printer of messages in the format of `rostopic echo`. Subscribe with `callback`.

    Attributes:
        done: whether the requested number of messages was printed, or printing failed.
        count: number of printed messages.
    """

    def __init__(
        self,
        topic: str,
        msg_eval: Callable[[Any], Any] | None,
        plot: bool = False,
        filter_fn: Callable[[Any], object] | None = None,
        echo_clear: bool = False,
        echo_all_topics: bool = False,
        offset_time: bool = False,
        count: int | None = None,
        field_filter_fn: FieldFilter | None = None,
        fixed_numeric_width: int | None = None,
        value_transform_fn: ValueTransform | None = None,
    ) -> None:
        """Store the settings.

        Args:
            topic: the topic; messages from other topics are ignored unless `echo_all_topics` is true.
            msg_eval: function that returns the part of a message to print; None for the whole message.
            plot: whether to print each message as a line of comma-separated values.
            filter_fn: function that returns whether to print a message.
            echo_clear: whether to clear the screen before each message.
            echo_all_topics: whether to print the messages of all topics.
            offset_time: whether to print times as offsets from the current time.
            count: number of messages to print; None for no limit.
            field_filter_fn: function that returns the names of the fields to print, given a message.
            fixed_numeric_width: width to which integers are padded and floats are truncated.
            value_transform_fn: function that transforms messages before they are printed.
        """
        self.topic = topic
        self.msg_eval = msg_eval
        self.plot = plot
        self.filter_fn = filter_fn
        self.fixed_numeric_width = fixed_numeric_width
        self.prefix = CLEAR_SCREEN if echo_clear else ""
        self.suffix = "" if plot else "\n---"
        self.echo_all_topics = echo_all_topics
        self.offset_time = offset_time
        self.done = False
        self.max_count = count
        self.count = 0
        self.field_filter = field_filter_fn
        self.value_transform = value_transform_fn
        self.str_fn: Callable[..., str] = self._row if plot else self.custom_strify_message
        self.first = True
        if plot:
            self.sep = ""
        self.last_topic: str | None = None
        self.last_msg_eval: Callable[[Any], Any] | None = None

    def custom_strify_message(
        self,
        val: Any,
        indent: str = "",
        time_offset: Any = None,
        current_time: Any = None,
        field_filter: FieldFilter | None = None,
        type_information: str | None = None,
        fixed_numeric_width: int | None = None,
        value_transform: ValueTransform | None = None,
    ) -> str:
        """Format a value. The bytes of a `uint8[]` field are formatted as numbers."""
        if value_transform is not None:
            val = value_transform(val, type_information)
        if isinstance(val, (bytes, bytearray)) and (type_information or "").startswith("uint8["):
            val = list(val)
        return strify_message(val, indent, time_offset, current_time, field_filter, fixed_numeric_width)

    def _row(self, val: Any, **more: Any) -> str:
        offset = more.get("time_offset")
        time = more.get("current_time")
        if time is None:
            is_stamped = isinstance(val, Message) and val._has_header
            time = val.header.stamp if is_stamped else rospy.get_rostime()
        part = Part(val, more.get("type_information"))
        offset_ns = 0 if offset is None else offset.to_nsec()
        return MessageRows(more.get("field_filter")).row(part, time.to_nsec(), offset_ns)

    def callback(self, data: Any, callback_args: Mapping[str, Any], current_time: Any = None) -> None:
        """Print a message.

        Args:
            data: the message.
            callback_args: a dictionary with `topic`, the message's topic, and `type_information`, the type of
                the message or of the part to print.
            current_time: time of receipt; defaults to the current time.
        """
        topic, kind = callback_args["topic"], callback_args["type_information"]
        if self.filter_fn is not None and not self.filter_fn(data):
            return
        try:
            if not self._is_enough() and (topic == self.topic or self.echo_all_topics):
                self._print(data, kind, current_time)
        except Exception:
            self.done = True
            traceback.print_exc()
        self.done |= self._is_enough()

    def _is_enough(self) -> bool:
        return self.max_count is not None and self.count >= self.max_count

    def _print(self, data: Any, kind: str, current_time: Any) -> None:
        if self.msg_eval is not None:
            data = self.msg_eval(data)
        if data is None:
            return
        self.count += 1
        if self.plot and self.first:
            print(MessageRows(self.field_filter).heading(Part(data, kind)))
            self.first = False
        text = self.str_fn(
            data,
            time_offset=rospy.get_rostime() if self.offset_time else None,
            current_time=current_time,
            field_filter=self.field_filter,
            type_information=kind,
            fixed_numeric_width=self.fixed_numeric_width,
            value_transform=self.value_transform,
        )
        sys.stdout.write(f"{self.prefix}{text}{self.suffix}\n")
        sys.stdout.flush()
