"""Live images: `rqt_image_view`. The browser converts pixels and decodes compressed images."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from typing import Any

from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros.pictures.image_message import IMAGE_TYPES
from pipros.server.view_server import RequestRefused
from pipros.web.image_pairs import APART_S, ImagePairs, stamp_ns
from pipros.web.image_pixels import packed
from pipros.web.topic_watch import TopicWatch
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

SEND_INTERVAL_S = 0.1
UNMATCHED_S = 2.0
"""Time (s) without a pair after which a browser gets the numbers of images on both topics instead."""


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
                    yield await self._packed(watch, newest.message)
                await asyncio.sleep(SEND_INTERVAL_S)

    async def _packed(self, watch: TopicWatch, message: AnyMsg) -> bytes:
        head, pixels = await self._system.computations.run(decoded_image, watch, message)
        text = json.dumps({**head, "topic": watch.topic, **watch.figures()})
        return text.encode() + b"\n" + pixels

    async def image_pair(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the newest pair of images of two topics, up to ten times a second.

        A pair is a JSON header with the sizes in bytes of both images and the difference of their timestamps
        (s, the other's minus the first's), a newline, and the images as `image` yields them.
        """
        pairs = ImagePairs()
        with (
            self._system.topics.watch(topic_name(arguments)) as one,
            self._system.topics.watch(topic_name({"name": arguments.get("other")})) as other,
            pairs.of(one, other),
        ):
            number, silent_s = 0, 0.0
            while True:
                newest = pairs.newest
                if newest is not None and newest[0] != number:
                    number, pair = newest
                    images = [await self._packed(one, pair[0]), await self._packed(other, pair[1])]
                    apart_s = (stamp_ns(pair[1]) - stamp_ns(pair[0])) / NS_PER_S
                    sizes = [len(image) for image in images]
                    yield json.dumps({"sizes": sizes, "apart": apart_s}).encode() + b"\n" + b"".join(images)
                    silent_s = 0.0
                elif silent_s > UNMATCHED_S:
                    silent_s = 0.0
                    yield {"counts": [one.figures()["count"], other.figures()["count"]], "within": APART_S}
                silent_s += SEND_INTERVAL_S
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
