"""Recover MCAP files that have no summary or are damaged. Records are copied, whatever their encoding."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Any

from pipros.basics.input_file import open_file
from pipros_tools.bag.errors import BagFormatError
from pipros_tools.bag.mcap_files import add_record, mcap_library, translated
from pipros_tools.bag.mcap_records import (
    ATTACHMENT,
    CHANNEL,
    HEADER,
    MESSAGE_START,
    METADATA,
    SCHEMA,
    McapSummary,
    all_records,
    parsed,
    read_summary,
)
from pipros_tools.bag.records import checked_time
from pipros_tools.bag.scan import Progress
from pipros_tools.bag.source import Source


def recover(path: str | os.PathLike[str], file: Any, progress: Progress) -> list[str]:
    """Copy the readable records of an MCAP file to `file`, and add a summary.

    A chunk whose content is damaged loses the records after the damage; damaged record lengths end the copy.
    Return descriptions of the damage; the list is empty if there is none.

    Raises:
        BagError: the library is missing, or the file does not begin like an MCAP file.
    """
    copy = _Copy(file)
    with open_file(path) as old:
        source = Source(old, os.fspath(path))
        copy.read_ahead(source)
        try:
            with translated(source.name):
                for kind, data in all_records(source, progress, copy.damage.append):
                    copy.add(kind, data)
        except BagFormatError as error:
            copy.damage.append(str(error))
    copy.finish()
    return copy.damage


class _Copy:
    """The new file. Schemas and channels get new numbers, in the order of the old file."""

    def __init__(self, file: Any) -> None:
        library = mcap_library()
        self._file = file
        self._writer = library.writer.Writer(file, compression=library.writer.CompressionType.ZSTD)
        self._is_started = False
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        self._lost: set[int] = set()
        self._odd: set[int] = set()
        self._known: McapSummary | None = None
        self.damage: list[str] = []

    def read_ahead(self, source: Source) -> None:
        """Read the summary, if there is one: it repeats the schemas and channels of damaged chunks."""
        with suppress(BagFormatError), translated(source.name):
            self._known = read_summary(source)

    def add(self, kind: int, data: bytes) -> None:
        from mcap.records import Attachment, Channel, Header, Metadata, Schema

        if kind == HEADER:
            self._start(parsed(Header, data).profile)
            return
        self._start()
        if kind == SCHEMA:
            self._add_schema(parsed(Schema, data))
        elif kind == CHANNEL:
            self._add_channel(parsed(Channel, data))
        elif kind in (METADATA, ATTACHMENT):
            add_record(self._writer, parsed(Metadata if kind == METADATA else Attachment, data))
        else:
            number, sequence, time, published = MESSAGE_START.unpack_from(data)
            try:
                checked_time(time, f"a message of channel {number} is lost")
            except BagFormatError as error:
                if number not in self._odd:
                    self._odd.add(number)
                    self.damage.append(str(error))
                return
            if self._known is not None and number in self._known.channels:
                self._add_channel(self._known.channels[number])
            if number in self._channels:
                self._writer.add_message(
                    self._channels[number], time, data[MESSAGE_START.size :], published, sequence
                )
            elif number not in self._lost:
                self._lost.add(number)
                self.damage.append(
                    f"the messages of channel {number} are lost, because its record is damaged"
                )

    def _add_schema(self, schema: Any) -> None:
        if schema.id not in self._schemas:
            new = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            self._schemas[schema.id] = new

    def _add_channel(self, channel: Any) -> None:
        if channel.id in self._channels:
            return
        if self._known is not None and channel.schema_id in self._known.schemas:
            self._add_schema(self._known.schemas[channel.schema_id])
        schema_id = self._schemas.get(channel.schema_id, 0)
        new = self._writer.register_channel(
            channel.topic, channel.message_encoding, schema_id, channel.metadata
        )
        self._channels[channel.id] = new

    def _start(self, profile: str = "ros1") -> None:
        if not self._is_started:
            self._is_started = True
            self._writer.start(profile=profile, library="pipros")

    def finish(self) -> None:
        self._start()
        self._writer.finish()
        self._file.flush()
