"""Live images: `rqt_image_view`. The browser converts pixels and decodes compressed images."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros.pictures.image_message import IMAGE_TYPES
from pipros.server.view_server import RequestRefused
from pipros.web.image_pixels import packed
from pipros.web.topic_watch import TopicWatch
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

SEND_INTERVAL_S = 0.1


class ImageViews:
    """The view of the Images tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def image(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield a topic's newest image up to ten times a second: a JSON header, a newline, and pixels."""
        with self._system.topics.watch(topic_name(arguments)) as watch:
            number = -1
            while True:
                newest = watch.newest
                if newest is not None and newest.number != number:
                    number = newest.number
                    head, pixels = await self._system.computations.run(decoded_image, watch, newest.message)
                    yield json.dumps({**head, **watch.figures()}).encode() + b"\n" + pixels
                await asyncio.sleep(SEND_INTERVAL_S)


def decoded_image(watch: TopicWatch, message: AnyMsg) -> tuple[Mapping[str, Any], bytes]:
    """Decode the image in a message, and encode it for the browser.

    Raises:
        RequestRefused: the message is not an image, or the page cannot show it.
        WrongDefinition: the publisher's definition differs from the installed one.
    """
    kind = message.header.get("type", "")
    if kind not in IMAGE_TYPES:
        raise RequestRefused(f"topic type must be {' or '.join(IMAGE_TYPES)}, got {printable(kind)}")
    return packed(watch.decode_as(message, load_message_class(kind)))
