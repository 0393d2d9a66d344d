"""Small images of what a bag contains."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros_libraries.pictures.image_message import IMAGE_TYPES
from pipros_page.bags.newest import newest_before
from pipros_page.images.pixels import packed
from pipros_page.limits import PageLimits
from pipros_tools.bag.reader import BagReader

THUMBNAIL_BYTES: Final = 30_000
"""Maximum size of the pixels."""


def thumbnail(read: Callable[[], BagReader], topic: str, moment_ns: int) -> bytes | None:
    """Return a topic's last image at or before a moment, scaled down, or None if it cannot be shown."""
    with read() as reader:
        connections = [each for each in reader.connections_of(topic) if each.type in IMAGE_TYPES]
        found = newest_before(reader, connections, moment_ns)
        if found is None or len(found.data) > process_limits().of(PageLimits).page_message_bytes:
            return None
        try:
            kind = load_message_class(found.connection.type)
            if kind._md5sum != found.connection.md5sum:
                return None
            head, pixels = packed(kind._from_bytes(found.data), THUMBNAIL_BYTES)
        except PiprosError:
            return None
    return json.dumps({**head, "at": moment_ns / NS_PER_S}).encode() + b"\n" + pixels
