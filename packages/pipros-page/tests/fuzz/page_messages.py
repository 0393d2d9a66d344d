"""Messages with any definition are shown by the page, or reported as invalid, without an exception.

An input is the definition, a line `===`, and the bytes.

python -m tests.fuzz.page_messages --seconds 60
"""

import json
import logging
import sys
import time
from contextlib import ExitStack, suppress
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.spec import DefinitionError
from pipros.node.any_msg import AnyMsg
from pipros_page.curve_samples import CurveField, number_in
from pipros_page.messages.known_topic import KnownTopic
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.console import Log
from pipros_page.views.diagnostics import Statuses
from pipros_page.views.frames import FrameTree
from pipros_page.views.images import decoded_image
from pipros_page.views.topics import percentage
from pipros_tools.graph.message_path import parse_path
from pipros_tools.graph.message_tree import message_tree
from pipros_tools.graph.raw_decoder import RawDecoder
from tests.fuzz import mutation
from tests.fuzz.definitions import LIMITS
from tests.fuzz.definitions import WORDS as DEFINITION_WORDS

KNOWN = ("tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "rosgraph_msgs/Log")
IMAGES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")
WORDS = [
    *DEFINITION_WORDS,
    *(b"string transforms\n", b"string status\n", b"float64 secs\nfloat64 nsecs\n", b"string to_sec\n"),
    *(b"uint8[] data\nstring encoding\n", b"float32 percentage\n", b"string __slots__\n", b"\n===\n"),
    *(b"\0\0\0\0\0\0\xf8\x7f", b"\0\0\0\0\0\0\xf0\x7f", b"\xff\xff\xff\xff", b"/tf"),
]
MAX_TEXT = 1_000_000


def target(data: bytes) -> None:
    text, _, body = data.partition(b"\n===\n")
    definition = text.decode("utf-8", "replace")
    for kind in (*KNOWN, *IMAGES):
        try:
            cls = message_classes_from_text(kind, definition, LIMITS)[kind]
        except DefinitionError:
            _read(kind, load_message_class(kind)._md5sum, "", body)
        else:
            _read(kind, cls._md5sum, definition, body)


def _read(kind: str, md5sum: str, definition: str, body: bytes) -> None:
    raw = AnyMsg(body)
    header = {"type": kind, "md5sum": md5sum, "message_definition": definition, "callerid": "/x"}
    raw._connection_header = header
    watch = TopicWatch("/topic", RawDecoder())
    tree, statuses, log = FrameTree(), Statuses(100_000), Log(100_000)
    takes = (
        lambda message, _, wall_s: tree.add(message, wall_s, "/x", is_static=False), statuses.add, log.add
    )  # fmt: skip
    with ExitStack() as stack:
        for known, take in zip(KNOWN, takes, strict=True):
            stack.enter_context(KnownTopic(watch, known, take).listening())
        watch.note(raw)
    shown: Any = tree.rows(time.time()), statuses.news({}, 100_000), log.since(0, 100_000), watch.figures()
    assert len(json.dumps(shown, allow_nan=False)) < MAX_TEXT
    with suppress(PiprosError):
        json.dumps(decoded_image(watch, raw)[0], allow_nan=False)
    try:
        message: Any = watch.decode(raw)
    except PiprosError:
        return
    assert len(json.dumps([message_tree(message), percentage(message)], allow_nan=False)) < MAX_TEXT
    for name in message.__slots__:
        try:
            json.dumps(number_in(message, CurveField("/topic", parse_path(name), name)), allow_nan=False)
        except (PiprosError, ValueError):
            continue


if __name__ == "__main__":
    logging.disable()  # each type logs its first string that is not UTF-8
    sys.exit(mutation.main(target, "page_messages", WORDS))
