"""Print messages for `rostopic echo` in the selected format."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from pipros.basics.errors import NotFound
from pipros.msg.text import strify_message
from pipros.msg.time import NS_PER_S, Time
from pipros.node.any_msg import AnyMsg
from pipros.node.clock import Clock
from pipros_tools.cli.rostopic.echo_options import EchoOptions
from pipros_tools.graph.elide import Elision
from pipros_tools.graph.listening import TopicPart
from pipros_tools.graph.message_filter import MessageFilter
from pipros_tools.graph.message_path import Part, describe_path, extract
from pipros_tools.graph.message_rows import MessageRows, field_filter
from pipros_tools.graph.raw_decoder import RawDecoder

CLEAR_SCREEN = "\x1b[2J\x1b[;H"


class MessagePrinter:
    """Printer for messages, up to the requested count."""

    def __init__(
        self, options: EchoOptions, source: TopicPart, clock: Clock | None, finish: Callable[[], object]
    ) -> None:
        """Store the arguments. `finish` is called after the last requested message."""
        self._options = options
        self._source = source
        self._clock = clock
        self._finish = finish
        self._decoder = RawDecoder()
        self._left = options.count
        self._filter = MessageFilter(options.expression) if options.expression else None
        self._rows = MessageRows(field_filter(no_arrays=options.no_arrays, no_texts=options.no_texts))
        self._elision = Elision(no_arrays=options.no_arrays, no_texts=options.no_texts)
        self._elides = options.no_arrays or options.no_texts
        self._has_heading = False
        if self._left is not None and self._left <= 0:
            finish()

    def show(self, raw: AnyMsg) -> None:
        """Print a message or the requested part of it. Print an error if the message lacks that part."""
        self.show_message(self._decoder.decode(raw), None, self._source.topic)

    def show_message(self, message: Any, received_ns: int | None, topic: str) -> None:
        """Print a decoded message; see `show`. In table rows, its time is `received_ns`, if given."""
        if self._filter is not None and not self._filter(message, topic):
            return
        try:
            part = extract(message, self._source.path)
        except NotFound as error:
            print(error, file=sys.stderr)
            return
        except IndexError as error:
            print(f"{error}: {describe_path(self._source.path)}", file=sys.stderr)
            return
        text = self._as_row(message, part, received_ns) if self._options.plot else self._as_text(part)
        sys.stdout.write(text)
        sys.stdout.flush()
        if self._left is not None:
            self._left -= 1
            if self._left <= 0:
                self._finish()

    def _as_text(self, part: Part) -> str:
        value = self._elision.of(part) if self._elides else _readable(part)
        now = _time(self._now_ns()) if self._options.offset else None
        text = strify_message(value, time_offset=now, fixed_numeric_width=self._options.width)
        return (CLEAR_SCREEN if self._options.clear else "") + text + "\n---\n"

    def _now_ns(self) -> int:
        return 0 if self._clock is None else self._clock.now_ns()

    def _as_row(self, message: Any, part: Part, received_ns: int | None) -> str:
        now_ns = time_ns = self._now_ns()
        if received_ns is not None:
            time_ns = received_ns
        elif part.value is message and message._has_header:
            time_ns = message.header.stamp.to_nsec()
        heading = ""
        if not self._has_heading:
            self._has_heading = True
            heading = self._rows.heading(part) + "\n"
        return heading + self._rows.row(part, time_ns, now_ns if self._options.offset else 0) + "\n"


def _readable(part: Part) -> Any:
    """Return a part's value. Convert a `uint8[]` field to a list of numbers, as printed inside a message."""
    if isinstance(part.value, (bytes, bytearray)) and (part.type_name or "").startswith("uint8["):
        return list(part.value)
    return part.value


def _time(nanoseconds: int) -> Time:
    return Time(*divmod(nanoseconds, NS_PER_S))
