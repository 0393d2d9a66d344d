"""The Bags tab (`rqt_bag`): opens the bags in a folder, and plays them for the other tabs."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import functools
import math
import tempfile
import threading
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.limits import process_limits
from pipros.msg.time import NS_PER_S
from pipros_page.bags.bag_system import not_recorded
from pipros_page.bags.curve import BagSamples, Take
from pipros_page.bags.export import FORMATS, export
from pipros_page.bags.folder import BagFolder
from pipros_page.bags.marks import BagMarks
from pipros_page.bags.notes import BadNotes, BagNotes, Note
from pipros_page.bags.open_bags import OpenBags
from pipros_page.bags.opening import OpeningProgress, description_of, open_with_progress
from pipros_page.bags.playback import LOG_TOPICS, BagPlayback
from pipros_page.bags.rewind import NAME, Recording
from pipros_page.bags.thumbnail import thumbnail
from pipros_page.bounded_list import bounded_list
from pipros_page.curve_samples import find_field, mark_of, sample_of
from pipros_page.limits import PageLimits
from pipros_page.views.plot import COMPUTED_S, axis_of, field_text
from pipros_page.views.topics import topic_name
from pipros_page.watched_system import WatchedSystem
from pipros_server.browser_share import Browser, browser_or_none, has_share
from pipros_server.view_server import RequestRefused
from pipros_tools.bag.errors import BagError, NoMessages
from pipros_tools.bag.layout import BagLayout
from pipros_tools.bag.opening import open_bag
from pipros_tools.bag.reader import BagReader

PAGE_BAGS = 20
"""Limit: bags that all browsers connected to a page have opened together. Beyond it, a browser cannot open a
further bag.
"""
PAGE_REWINDS = 4
"""Limit: browsers that show kept messages at the same time; for each of them, up to `page_rewind_bytes` stay
in memory. Beyond it, a further browser cannot rewind; for each rewinding browser, the server keeps the shown
messages in memory, at most `page_rewind_bytes`.
"""
PAGE_EXPORTS = 2
"""Limit: concurrent exports by all browsers connected to a page; each needs a temporary file. Beyond it, a
browser cannot start a further export until one has ended.
"""

STATE_INTERVAL_S: Final = 0.1
CLOSING_TURNS: Final = 20
LIST_INTERVAL_S: Final = 2.0
PIECE_BYTES: Final = 1_000_000
MAX_THUMBNAILS: Final = 60


Read = Callable[[], BagReader]
"""Returns a new reader of a bag."""


class BagViews:
    """The views and actions of the Bags tab.

    Args:
        folder: the folder whose bags browsers may open; None if there is no folder.
        open_bags: the bags that are open.
        may_note: whether browsers may write notes beside bags.
        computed_s: maximum processor time for one sample of an expression.
    """

    def __init__(
        self,
        system: WatchedSystem,
        folder: BagFolder | None,
        open_bags: OpenBags,
        *,
        may_note: bool = False,
        computed_s: float = COMPUTED_S,
    ) -> None:
        self._computed_s = computed_s
        self._may_note = may_note
        self._noting = threading.Lock()
        self._system = system
        self._folder = folder
        self._open_bags = open_bags
        self._opening = self._rewinds = 0
        self._exporting: list[Browser | None] = []

    async def bags(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Periodically yield the list of bags in the folder, with their sizes."""
        while True:
            names = [] if self._folder is None else await self._system.questions.run(self._folder.names)
            yield {
                "bags": bounded_list([{"name": name, "size": size} for name, size in names]),
                "folder": "" if self._folder is None else str(self._folder.path),
            }
            await asyncio.sleep(LIST_INTERVAL_S)

    async def bag(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Open a bag. Yield the progress, then the bag's tracks, and then each new state of the playback.

        Until this view is closed, the browser's other views show the bag at its current moment. With the
        argument `rewind`, the bag consists of the running system's recent messages.
        """
        is_rewind = arguments.get("rewind") is True
        shown = self._shown(NAME if is_rewind else arguments.get("name"), is_rewind=is_rewind)
        with self._rewinding() if is_rewind else contextlib.nullcontext():
            async with contextlib.aclosing(shown) as values:
                async for value in values:
                    yield value

    async def _shown(self, name: object, *, is_rewind: bool) -> AsyncGenerator[Any, None]:
        for _ in range(CLOSING_TURNS):  # the view of the previous bag may still be closing
            if self._open_bags.playback is None:
                break
            await asyncio.sleep(STATE_INTERVAL_S)
        else:
            raise RequestRefused("this browser has already opened a bag")
        limit = PAGE_BAGS
        if self._opening + len(self._open_bags) >= limit:
            raise RequestRefused(f"too many bags are open; the limit is {limit}")
        opening = OpeningProgress()
        opened = self._system.computations.start(self._opened, name, opening, is_rewind)
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
            waiting.cancel()  # so that asyncio does not report an error that occurs after the view was closed
        try:
            playback = BagPlayback(self._system, reader)
        except NoMessages as error:
            reader.close()
            raise RequestRefused(str(error)) from None
        with self._open_bags.showing(playback), contextlib.ExitStack() as stack:
            # Keep recording the topics that only this browser watches until it shows the running system
            # again.
            for watch in self._system.topics.watches() if is_rewind else ():
                stack.enter_context(self._system.topics.watch(watch.topic))
            yield {"bag": description}
            shown: Any = None
            while True:
                state = dataclasses.asdict(playback.state)
                if state != shown:
                    shown = state
                    yield {"state": state}
                await asyncio.sleep(STATE_INTERVAL_S)

    async def bag_control(self, arguments: Mapping[str, Any]) -> Any:
        """Control the playback of this browser's bag: play, pause, loop, step, jump, or change the speed."""
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

    async def bag_thumbnails(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield a small image from a topic for each of the given times: a JSON header, a newline, and pixels.

        Omit times for which no image can be shown.
        """
        read, topic = self._source(arguments), topic_name({"name": arguments.get("topic")})
        times = arguments.get("times")
        if not isinstance(times, list) or len(times) > MAX_THUMBNAILS:
            raise RequestRefused(f"times must be a list of at most {MAX_THUMBNAILS} numbers")
        moments = [round(_number({"time": each}, "time") * NS_PER_S) for each in times]
        for moment_ns in moments:
            found = await self._system.computations.run(thumbnail, read, topic, moment_ns)
            if found is not None:
                yield found

    async def bag_curve(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield, in pieces, the samples of a plotted field in the whole bag that this browser has opened."""
        text, axis = field_text(arguments), axis_of(arguments)
        playback = self._playback()
        field = find_field(text, playback.system.observation.types)
        if field is None and playback.recording is not None:
            raise not_recorded(text)
        if field is None:
            raise RequestRefused(f"the bag does not contain the topic of {text}")
        chosen = field

        def take(message: object, time_s: float) -> list[float | str | None] | None:
            return sample_of(message, chosen, axis, time_s, time_s) if chosen.holds(message) else None

        limit_s = self._computed_s if field.has_expression else math.inf
        async for piece in self._samples(arguments, {field.topic}, take, limit_s):
            yield piece

    async def bag_marks(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the warnings and errors logged in the whole bag, like `PlotViews.log_marks`."""
        axis = axis_of(arguments)
        topics = {each for each in LOG_TOPICS if each in self._playback().system.observation.types}
        topics = topics if len(topics) == 1 else topics - {LOG_TOPICS[1]}

        def take(entry: object, time_s: float) -> list[Any] | None:
            return mark_of(entry, axis, time_s, time_s) if hasattr(entry, "level") else None

        async for piece in self._samples(arguments, topics, take):
            yield {"marks": piece["samples"], "lost": piece["lost"]}

    async def bag_events(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the `marks` of the bag that this browser has opened, in pieces; then its `notes`, and again
        after each change. See `BagMarks` and `BagNotes`.
        """
        read, work = self._source(arguments), self._system.computations.run
        reader = await work(read)
        try:
            marks = BagMarks(reader)
            while (found := await work(marks.next_piece)) is not None:
                yield {"marks": found, "lost": marks.left_out}
        except (BagError, OSError) as error:
            yield {"error": str(error)}
        finally:
            reader.close()
        if self._playback().recording is not None:
            return
        path, shown = self._path(arguments.get("name")), None
        while True:
            values = await self._system.questions.run(_notes, path)
            if values != shown:
                shown = values
                yield {**values, "may_note": self._may_note}
            await asyncio.sleep(LIST_INTERVAL_S)

    async def add_note(self, arguments: Mapping[str, object]) -> Any:
        """Add a note with a `time` and a `text` to the bag `name`. Return all notes."""
        return await self._note(arguments, BagNotes.add)

    async def remove_note(self, arguments: Mapping[str, object]) -> Any:
        """Remove a note; see `add_note`."""
        return await self._note(arguments, BagNotes.remove)

    async def _note(
        self, arguments: Mapping[str, object], change: Callable[[BagNotes, Note], Sequence[Note]]
    ) -> Any:
        if not self._may_note:
            raise RequestRefused("this page may not write notes; start it with --control")
        note = Note(arguments.get("time"), arguments.get("text"))  # type: ignore[arg-type]
        notes = BagNotes(self._path(arguments.get("name")))

        def write() -> list[Mapping[str, Any]]:
            with self._noting:
                return [dataclasses.asdict(each) for each in change(notes, note)]

        return await self._system.questions.run(write)

    async def _samples(
        self, arguments: Mapping[str, object], topics: set[str], take: Take, limit_s: float = math.inf
    ) -> AsyncIterator[Mapping[str, Any]]:
        read, work = self._source(arguments), self._system.computations.run
        reader = await work(read)
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

    async def bag_export(self, arguments: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield part of a bag as the chunks of a file, then `{"done": true}`.

        The file is temporary; at most `PAGE_EXPORTS` exist at a time; see also `has_share`.
        """
        read, form, topics = self._source(arguments), arguments.get("format"), arguments.get("topics")
        if form not in FORMATS or not isinstance(topics, list) or not topics:
            raise RequestRefused(f"format must be one of {', '.join(FORMATS)}, and topics a non-empty list")
        range_ns = tuple(round(_number(arguments, key) * NS_PER_S) for key in ("begin", "end"))
        wanted = {topic_name({"name": each}) for each in topics}
        work = self._system.computations.run
        limit = PAGE_EXPORTS
        browser = browser_or_none()
        if not has_share(browser, self._exporting, limit):
            what = "too many exports are running; try again when one has ended"
            raise RequestRefused(f"{what}; the limit is {limit}")
        self._exporting.append(browser)
        try:
            with tempfile.TemporaryFile() as file:
                await work(_export, read, wanted, (range_ns[0], range_ns[1]), form, file)
                file.seek(0)
                while piece := await work(file.read, PIECE_BYTES):
                    yield piece
        except OSError as error:  # refuse, because a view is retried after other errors
            raise RequestRefused(f"cannot export: {error}") from None
        finally:
            self._exporting.remove(browser)
        yield {"done": True}

    def _playback(self) -> BagPlayback:
        playback = self._open_bags.playback
        if playback is None:
            raise RequestRefused("this browser has not opened a bag")
        return playback

    def _source(self, arguments: Mapping[str, object]) -> Read:
        """Return a function that returns another reader of the bag that this browser has opened."""
        playback = self._playback()
        if playback.recording is not None:
            return playback.recording.again
        return functools.partial(_reader, self._path(arguments.get("name")), playback.layout)

    @contextlib.contextmanager
    def _rewinding(self) -> Iterator[None]:
        """Count a browser that shows recent messages. Raise `RequestRefused` if there are too many."""
        limit = PAGE_REWINDS
        if self._rewinds >= limit:
            what = "too many browsers are showing the past"
            raise RequestRefused(f"{what}; the limit is {limit}")
        self._rewinds += 1
        try:
            yield
        finally:
            self._rewinds -= 1

    def _path(self, name: object) -> Path:
        if self._folder is None:
            raise RequestRefused("this page has no bag folder; start it with --bags DIR")
        try:
            return self._folder.find(name)
        except BagError as error:
            raise RequestRefused(str(error)) from None

    def _opened(
        self, name: object, opening: OpeningProgress, is_rewind: bool
    ) -> tuple[BagReader, Mapping[str, Any]]:
        try:
            reader = self._recording() if is_rewind else open_with_progress(self._path(name), opening)
        except (BagError, OSError) as error:
            raise RequestRefused(f"cannot open {name}: {error}") from None
        try:
            description = {"name": name, "rewind": is_rewind, **description_of(reader)}
        except (BagError, OSError) as error:
            reader.close()
            raise RequestRefused(f"cannot open {name}: {error}") from None
        if opening.is_cancelled:
            reader.close()
        return reader, description

    def _recording(self) -> Recording:
        if self._system.recent is None:
            raise RequestRefused("the past is not recorded; start the command without --rewind 0")
        return self._system.recent.recording()


def _notes(bag: Path) -> Mapping[str, Any]:
    try:
        return {"notes": [dataclasses.asdict(each) for each in BagNotes(bag).read()]}
    except BadNotes as error:
        return {"notes": [], "error": str(error)}


def _number(arguments: Mapping[str, object], key: str) -> float:
    value = arguments.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise RequestRefused(f"{key} must be a finite number >= 0, got {value!r:.100}")
    return float(value)


def _reader(path: Path, layout: BagLayout | None) -> BagReader:
    return open_bag(path) if layout is None else BagReader(path, layout=layout)


def _export(read: Read, topics: set[str], range_ns: tuple[int, int], form: str, file: IO[bytes]) -> None:
    try:
        with read() as reader:
            export(reader, topics, range_ns, form, file, process_limits().of(PageLimits).page_export_bytes)
    except PiprosError as error:
        raise RequestRefused(str(error)) from None
