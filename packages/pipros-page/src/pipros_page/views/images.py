"""Live images: `rqt_image_view`. The browser converts pixels and decodes compressed images."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node.any_msg import AnyMsg
from pipros_libraries.pictures.image_message import IMAGE_TYPES
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.pose import Pose
from pipros_page.images.overlays import Camera, OverlayMarkers, detection_shapes, marker_shapes
from pipros_page.images.pairs import APART_S, ImagePairs, stamp_ns
from pipros_page.images.pixels import packed
from pipros_page.messages.known_topic import KnownTopic
from pipros_page.topic_watch import TopicWatch
from pipros_page.views.frames import LONGEST_ERROR, FrameTree, open_frames
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.view_server import RequestRefused

SEND_INTERVAL_S = 0.1
MAX_UNDRAWN = 20
"""Maximum number of messages with detections that wait for a slow browser."""
UNMATCHED_S = 2.0
"""Time (s) without a pair after which the numbers of images on both topics are sent instead."""


class ImageViews:
    """The views of the Images tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def image(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield a topic's newest image up to ten times a second: a JSON header, a newline, and pixels.

        For an image that cannot be shown, yield a dictionary with an `error`, and continue.
        """
        with self._system.topics.watch(topic_name(arguments)) as watch:
            number = -1
            while True:
                newest = watch.newest
                if newest is not None and newest.number != number:
                    number = newest.number
                    try:
                        yield await self._packed(watch, newest.message)
                    except RequestRefused as refusal:
                        yield {"error": str(refusal)}
                await asyncio.sleep(SEND_INTERVAL_S)

    async def _packed(self, watch: TopicWatch, message: AnyMsg) -> bytes:
        head, pixels = await self._system.computations.run(decoded_image, watch, message)
        text = json.dumps({**head, "stamp": stamp_ns(message), "topic": watch.topic, **watch.figures()})
        return text.encode() + b"\n" + pixels

    async def image_pair(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the newest pair of images of two topics, up to ten times a second.

        A pair is a JSON header with the sizes in bytes of both images and the difference of their timestamps
        (s, the second's minus the first's), a newline, and the images as `image` yields them. After
        `UNMATCHED_S` without a pair, yield the numbers of images received on both topics instead.
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
                    silent_s = 0.0
                    try:
                        images = [await self._packed(one, pair[0]), await self._packed(other, pair[1])]
                    except RequestRefused as refusal:
                        yield {"error": str(refusal)}
                        continue
                    apart_s = (stamp_ns(pair[1]) - stamp_ns(pair[0])) / NS_PER_S
                    sizes = [len(image) for image in images]
                    yield json.dumps({"sizes": sizes, "apart": apart_s}).encode() + b"\n" + b"".join(images)
                elif silent_s > UNMATCHED_S:
                    silent_s = 0.0
                    yield {"counts": [one.figures()["count"], other.figures()["count"]], "within": APART_S}
                silent_s += SEND_INTERVAL_S
                await asyncio.sleep(SEND_INTERVAL_S)

    async def image_overlay(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield a topic's shapes, to draw over the images of the topic `image`, and an error (may be empty).

        The shapes are a list of dictionaries with `stamp` (ns) and `shapes`, in pixels of the image. There is
        one dictionary for each `Detection2DArray` since the last value. For markers, there is a single
        dictionary with the stamp 0, and the markers are projected with the image's `camera_info` and the
        newest transforms.
        """
        image = topic_name({"name": arguments.get("image")})
        with self._system.topics.watch(topic_name(arguments)) as watch, contextlib.ExitStack() as stack:
            drawn = _Overlay(self._system, watch, image, stack)
            shown: Any = None
            while True:
                values = await self._system.computations.run(drawn.values)
                if values != shown:
                    shown = values
                    yield values
                await asyncio.sleep(SEND_INTERVAL_S)


class _Overlay:
    """Draws the detections, or the current markers, of a topic.

    One thread at a time calls `values`.
    """

    def __init__(
        self, system: WatchedSystem, watch: TopicWatch, image: str, stack: contextlib.ExitStack
    ) -> None:
        self._system = system
        self._watch = watch
        self._markers = OverlayMarkers()
        self._camera: Camera | None = None
        self._error = ""
        self._undrawn: deque[AnyMsg] = deque(maxlen=MAX_UNDRAWN)
        self._detections: Mapping[str, Any] = {"over": [], "error": ""}
        self._info = info_topic(image, system.observation.types)
        self._tree: FrameTree | None = None
        if system.observation.types.get(watch.topic, "").endswith("/Detection2DArray"):
            listening = watch.listening(lambda message, _: self._undrawn.append(message), from_newest=True)
            stack.enter_context(listening)
        else:
            stack.enter_context(watch.listening(self._take, from_newest=True))
            info = stack.enter_context(system.topics.watch(self._info))
            stack.enter_context(KnownTopic(info, "sensor_msgs/CameraInfo", self._locate).listening())
            self._tree = stack.enter_context(system.shared(open_frames).use())[0]

    def values(self) -> Mapping[str, Any]:
        """Return the shapes and an error for the browser."""
        return self._of_detections() if self._tree is None else self._of_markers(self._tree)

    def _of_detections(self) -> Mapping[str, Any]:
        over, error = [], ""
        while self._undrawn:
            try:
                decoded: Any = self._watch.decode(self._undrawn.popleft())
                over.append({"stamp": decoded.header.stamp.to_nsec(), "shapes": detection_shapes(decoded)})
            except (PiprosError, AttributeError, TypeError) as problem:
                error = f"{self._watch.topic} cannot be drawn: {problem}"
        if over or error:
            self._detections = {"over": over, "error": error}
        return self._detections

    def _take(self, message: AnyMsg, wall_s: float) -> None:
        try:
            self._markers.add(self._watch.decode(message), wall_s)
        except (PiprosError, AttributeError) as error:
            self._error = f"{self._watch.topic} cannot be drawn: {error}"

    def _locate(self, info: object, _raw: AnyMsg, _wall_s: float) -> None:
        try:
            self._camera = Camera(info)
        except ValueError as error:
            self._error = f"{self._info}: {error}"

    def _of_markers(self, tree: FrameTree) -> Mapping[str, Any]:
        camera = self._camera
        if camera is None:
            return _unstamped([], self._error or f"no CameraInfo has been received on {self._info} yet")
        poses: dict[str, Pose] = {}

        def pose_in(frame: str) -> Pose:
            if frame not in poses:
                poses[frame] = tree.buffer.lookup(camera.frame, frame, 0)[1]
            return poses[frame]

        try:
            shapes = marker_shapes(self._markers.shown(self._system.now_s()), camera, pose_in)
        except TransformException as error:
            return _unstamped([], str(error)[:LONGEST_ERROR])
        return _unstamped(shapes, self._error)


def _unstamped(shapes: Sequence[Mapping[str, Any]], error: str) -> Mapping[str, Any]:
    return {"over": [{"stamp": 0, "shapes": shapes}], "error": error}


def info_topic(image: str, types: Mapping[str, str]) -> str:
    """Return an image's CameraInfo topic: in its namespace, or one level up for `…/compressed`."""
    parent = image.rpartition("/")[0]
    base = parent.rpartition("/")[0]
    names = (f"{parent}/camera_info", f"{base}/camera_info")
    return next((name for name in names if name in types), names[0])


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
