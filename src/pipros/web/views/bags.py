"""The Bags tab (`rqt_bag`): opens the bags in a folder, and plays them for the other tabs."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import math
import tempfile
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

from pipros.bag.errors import BagError, NoMessages, NotIndexed
from pipros.bag.layout import BagLayout
from pipros.bag.opening import is_mcap, open_bag
from pipros.bag.reader import BagReader
from pipros.basics.errors import PiprosError
from pipros.basics.limits import limit_text, process_limits
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.pictures.image_message import IMAGE_TYPES
from pipros.server.view_server import RequestRefused
from pipros.web.bags.curve import BagSamples, Take
from pipros.web.bags.export import FORMATS, export
from pipros.web.bags.folder import BagFolder
from pipros.web.bags.open_bags import OpenBags
from pipros.web.bags.playback import LOG_TOPICS, BagPlayback, newest_before
from pipros.web.bags.tracks import BINS, tracks
from pipros.web.bounded_list import bounded_list
from pipros.web.curve_samples import find_field, mark_of, sample_of
from pipros.web.image_pixels import packed
from pipros.web.limits import PageLimits
from pipros.web.views.plot import COMPUTED_S, axis_of, field_text
from pipros.web.views.topics import topic_name
from pipros.web.watched_system import WatchedSystem

STATE_INTERVAL_S: Final = 0.1
CLOSING_TURNS: Final = 20
LIST_INTERVAL_S: Final = 2.0
PIECE_BYTES: Final = 1_000_000
THUMBNAIL_BYTES: Final = 30_000
MAX_THUMBNAILS: Final = 60


class _Cancelled(BagError):
    """The browser has stopped waiting for the bag to open."""


@dataclass(slots=True)
class _Opening:
    """Progress of reading a bag without an index."""

    share: float = 0.0
    is_cancelled: bool = False

    def note(self, share: float) -> None:
        self.share = round(min(share, 1.0), 3)
        if self.is_cancelled:
            raise _Cancelled("cancelled")


class BagViews:
    """The views and actions of the Bags tab.

    Args:
        folder: the folder whose bags browsers may open; None if they may open none.
        open_bags: the bags that are open.
        computed_s: maximum processor time for one sample of an expression.
    """

    def __init__(
        self,
        system: WatchedSystem,
        folder: BagFolder | None,
        open_bags: OpenBags,
        *,
        computed_s: float = COMPUTED_S,
    ) -> None:
        self._computed_s = computed_s
        self._system = system
        self._folder = folder
        self._open_bags = open_bags
        self._opening = 0
        self._exports = 0

    async def bags(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the names and sizes of the bags in the folder."""
        while True:
            names = [] if self._folder is None else await self._system.questions.run(self._folder.names)
            yield {
                "bags": bounded_list([{"name": name, "size": size} for name, size in names]),
                "folder": "" if self._folder is None else str(self._folder.path),
            }
            await asyncio.sleep(LIST_INTERVAL_S)

    async def bag(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Open a bag. Yield the progress, then its tracks, and then each change of the playback's state.

        Until this view is closed, the browser's other views show the bag at its current moment.
        """
        for _ in range(CLOSING_TURNS):  # the view of the previous bag may still be closing
            if self._open_bags.playback is None:
                break
            await asyncio.sleep(STATE_INTERVAL_S)
        else:
            raise RequestRefused("this browser has already opened a bag")
        limit = process_limits().of(PageLimits).page_bags
        if self._opening + len(self._open_bags) >= limit:
            raise RequestRefused(f"too many bags are open; {limit_text('page_bags', limit)}")
        opening = _Opening()
        opened = self._system.computations.start(self._opened, arguments.get("name"), opening)
        waiting = asyncio.wrap_future(opened)
        self._opening += 1
        try:
            while not waiting.done():
                yield {"opening": opening.share}
                await asyncio.wait([waiting], timeout=STATE_INTERVAL_S)
            reader, description = waiting.result()
        finally:
            self._opening -= 1
            opening.is_cancelled = True
            waiting.cancel()  # so that asyncio does not report an error that comes after the view was closed
        try:
            playback = BagPlayback(self._system, reader)
        except NoMessages as error:
            reader.close()
            raise RequestRefused(str(error)) from None
        with self._open_bags.showing(playback):
            yield {"bag": description}
            shown: Any = None
            while True:
                state = dataclasses.asdict(playback.state)
                if state != shown:
                    shown = state
                    yield {"state": state}
                await asyncio.sleep(STATE_INTERVAL_S)

    async def bag_control(self, arguments: Mapping[str, Any]) -> Any:
        """Control the playback of this browser's bag: play, pause, step, jump, or change the speed."""
        playback = self._playback()
        if isinstance(arguments.get("play"), bool):
            playback.play(arguments["play"])
        if isinstance(arguments.get("loop"), bool):
            playback.set_loop(arguments["loop"])
        if "speed" in arguments:
            playback.set_speed(_number(arguments, "speed"))
        if "jump" in arguments:
            playback.jump(round(_number(arguments, "jump") * NS_PER_S))
        if arguments.get("step") in (1, -1):
            topics = arguments.get("topics", [])
            playback.step(arguments["step"], list(map(str, topics)) if isinstance(topics, list) else [])
        return dataclasses.asdict(playback.state)

    async def bag_thumbnails(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield small images from a topic at the given times: a JSON header, a newline, and pixels."""
        path, topic = self._path(arguments.get("name")), topic_name({"name": arguments.get("topic")})
        times = arguments.get("times")
        if not isinstance(times, list) or len(times) > MAX_THUMBNAILS:
            raise RequestRefused(f"times must be a list of at most {MAX_THUMBNAILS} numbers")
        moments = [round(_number({"time": each}, "time") * NS_PER_S) for each in times]
        layout = self._playback().layout
        for moment_ns in moments:
            found = await self._system.computations.run(_thumbnail, path, layout, topic, moment_ns)
            if found is not None:
                yield found

    async def bag_curve(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield, in pieces, a plotted field's samples from the whole bag that this browser has opened."""
        text, axis = field_text(arguments), axis_of(arguments)
        field = find_field(text, self._playback().system.observation.types)
        if field is None:
            raise RequestRefused(f"the bag does not contain the topic of {text}")
        chosen = field

        def take(message: Any, time_s: float) -> list[float | None] | None:
            return sample_of(message, chosen, axis, time_s, time_s) if chosen.holds(message) else None

        limit_s = self._computed_s if field.has_expression else math.inf
        async for piece in self._samples(arguments, {field.topic}, take, limit_s):
            yield piece

    async def bag_marks(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield the warnings and errors logged in the whole bag, like `PlotViews.log_marks`."""
        axis = axis_of(arguments)
        topics = {each for each in LOG_TOPICS if each in self._playback().system.observation.types}
        topics = topics if len(topics) == 1 else topics - {LOG_TOPICS[1]}

        def take(entry: Any, time_s: float) -> list[Any] | None:
            return mark_of(entry, axis, time_s, time_s) if hasattr(entry, "level") else None

        async for piece in self._samples(arguments, topics, take):
            yield {"marks": piece["samples"], "lost": piece["lost"]}

    async def _samples(
        self, arguments: Mapping[str, Any], topics: set[str], take: Take, limit_s: float = math.inf
    ) -> AsyncIterator[Mapping[str, Any]]:
        path, layout = self._path(arguments.get("name")), self._playback().layout
        work = self._system.computations.run
        reader = await work(_reader, path, layout)
        try:
            connections = [each for each in reader.connections if each.topic in topics]
            samples = BagSamples(reader, connections, take, limit_s)
            yield {"samples": [], "lost": samples.left_out, "error": ""}
            while (piece := await work(samples.next_piece)) is not None:
                yield {"samples": piece[0], "lost": 0, "error": piece[1]}
        except (BagError, OSError) as error:
            raise RequestRefused(str(error)) from None
        finally:
            reader.close()

    async def bag_export(self, arguments: Mapping[str, Any]) -> AsyncIterator[Any]:
        """Yield part of a bag as the chunks of a file, then `{"done": true}`.

        The file is temporary; at most `page_exports` exist at a time.
        """
        path, form, topics = (
            self._path(arguments.get("name")),
            arguments.get("format"),
            arguments.get("topics"),
        )
        if form not in FORMATS or not isinstance(topics, list) or not topics:
            raise RequestRefused(f"format must be one of {', '.join(FORMATS)}, and topics a list of names")
        range_ns = tuple(round(_number(arguments, key) * NS_PER_S) for key in ("begin", "end"))
        wanted = {topic_name({"name": each}) for each in topics}
        layout, work = self._playback().layout, self._system.computations.run
        limit = process_limits().of(PageLimits).page_exports
        if self._exports >= limit:
            what = "too many exports are running; try again when one has ended"
            raise RequestRefused(f"{what}; {limit_text('page_exports', limit)}")
        self._exports += 1
        try:
            with tempfile.TemporaryFile() as file:
                await work(_export, path, layout, wanted, (range_ns[0], range_ns[1]), form, file)
                file.seek(0)
                while piece := await work(file.read, PIECE_BYTES):
                    yield piece
        except OSError as error:  # refuse, because a view is retried after other errors
            raise RequestRefused(f"cannot export: {error}") from None
        finally:
            self._exports -= 1
        yield {"done": True}

    def _playback(self) -> BagPlayback:
        playback = self._open_bags.playback
        if playback is None:
            raise RequestRefused("this browser has not opened a bag")
        return playback

    def _path(self, name: object) -> Path:
        if self._folder is None:
            raise RequestRefused("this page has no bag folder; start it with --bags DIR")
        try:
            return self._folder.find(name)
        except BagError as error:
            raise RequestRefused(str(error)) from None

    def _opened(self, name: object, opening: _Opening) -> tuple[BagReader, Mapping[str, Any]]:
        path = self._path(name)
        try:
            try:
                reader = open_bag(path)
            except NotIndexed:
                if is_mcap(path):
                    raise
                size = max(path.stat().st_size, 1)
                reader = BagReader(path, rebuild_index=True, progress=lambda at: opening.note(at / size))
        except (BagError, OSError) as error:
            raise RequestRefused(f"cannot open {name}: {error}") from None
        try:
            begin_ns, end_ns = reader.range_ns
            description = {
                "name": name,
                "begin": begin_ns / NS_PER_S,
                "end": end_ns / NS_PER_S,
                "size": reader.size,
                "bins": BINS,
                "damage": reader.damage[:3],
                "tracks": bounded_list(map(dataclasses.asdict, tracks(reader))),
            }
        except (BagError, OSError) as error:
            reader.close()
            raise RequestRefused(f"cannot open {name}: {error}") from None
        if opening.is_cancelled:
            reader.close()
        return reader, description


def _number(arguments: Mapping[str, Any], key: str) -> float:
    value = arguments.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise RequestRefused(f"{key} must be a number >= 0, got {value!r:.100}")
    return float(value)


def _reader(path: Path, layout: BagLayout | None) -> BagReader:
    return open_bag(path) if layout is None else BagReader(path, layout=layout)


def _export(
    path: Path,
    layout: BagLayout | None,
    topics: set[str],
    range_ns: tuple[int, int],
    form: str,
    file: IO[bytes],
) -> None:
    try:
        with _reader(path, layout) as reader:
            export(reader, topics, range_ns, form, file, process_limits().of(PageLimits).page_export_bytes)
    except PiprosError as error:
        raise RequestRefused(str(error)) from None


def _thumbnail(path: Path, layout: BagLayout | None, topic: str, moment_ns: int) -> bytes | None:
    """Return a topic's last image at or before a moment, scaled down, or None if it cannot be shown."""
    with _reader(path, layout) as reader:
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
