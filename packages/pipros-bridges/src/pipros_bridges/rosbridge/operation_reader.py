"""Read operations from what a client sends: JSON or BSON frames, streams of JSON objects, and fragments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pipros.basics.printable import printable
from pipros_bridges.rosbridge.bson_size import parsed_bson_bytes
from pipros_bridges.rosbridge.encoding import bson_codec
from pipros_bridges.rosbridge.text_input import (
    BadInput,
    Fragments,
    JsonObjects,
    json_object,
    parsed_json_bytes,
)
from pipros_bridges.shares import ClientShares

Operations = Iterator[dict[str, Any] | BadInput]
"""Operations, and errors in place of what is not an operation. Each counts until the next one is read."""


class OperationReader:
    """Reads one client's operations, within the client's shares of memory.

    Attributes:
        parsed_bytes: approximate memory of the operation that was read last; 0 for a short one.
    """

    def __init__(
        self, shares: ClientShares, fragment_timeout_s: float, clock_s: Callable[[], float], *, is_bson: bool
    ) -> None:
        self.parsed_bytes = 0
        self._shares = shares
        self._clock_s = clock_s
        self._is_bson = is_bson
        self._objects = JsonObjects(shares.message_bytes, shares.input)
        self._fragments = Fragments(shares.message_bytes, fragment_timeout_s, shares.input)

    def read(self, data: str | bytes) -> Operations:
        """Read a frame, which may be part of a JSON text.

        If a text is incomplete and the next frame is a whole operation, the incomplete text is discarded, and
        an error is yielded.
        """
        try:
            if isinstance(data, bytes) and self._is_bson:
                yield self._bson_object(data)
                return
            self._begin_parsing(parsed_json_bytes(data))
        except BadInput as error:
            yield error
            return
        try:
            operation = json_object(data)
        except BadInput:
            yield from self.read_stream(data if isinstance(data, str) else data.decode(errors="replace"))
            return
        if not self._objects.is_empty and "op" in operation:
            self._objects.clear()
            yield BadInput("the previous text was not complete JSON and was discarded")
        yield operation

    def read_stream(self, text: str) -> Operations:
        """Read the next part of a stream of JSON objects."""
        for found in self._objects.feed(text):
            try:
                operation = self._parsed(found) if isinstance(found, str) else found
            except BadInput as error:
                yield error
            else:
                yield operation

    def join(self, fragment: dict[str, Any]) -> dict[str, Any] | None:
        """Add a fragment. Return the whole operation if this was its last missing fragment.

        Raises:
            BadInput: the fragment is malformed, or the whole is too large or not a JSON object.
        """
        text = self._fragments.add(fragment, self._clock_s())
        return None if text is None else self._parsed(text)

    def end_message(self) -> int:
        """Give back the memory that is counted for the current operation, and return its size."""
        size_bytes = self.parsed_bytes
        self._begin_parsing(0)
        return size_bytes

    @property
    def incomplete_bytes(self) -> int:
        """Memory of the incomplete text at the end of a stream."""
        return self._objects.held_bytes

    def _parsed(self, text: str) -> dict[str, Any]:
        self._begin_parsing(parsed_json_bytes(text))
        return json_object(text)

    def _begin_parsing(self, size_bytes: int) -> None:
        """Reserve memory for a parsed message, replacing the reservation for the previous message.

        Raises:
            BadInput: too little memory is left.
        """
        if not self._shares.parsed.hold(self.parsed_bytes, size_bytes):
            limit = f"the limit is {int(self._shares.parsed.limit)} bytes"
            raise BadInput(f"a message with so many values needs too much memory; {limit}")
        self.parsed_bytes = size_bytes

    def _bson_object(self, data: bytes) -> dict[str, Any]:
        bson = bson_codec()
        try:
            self._begin_parsing(parsed_bson_bytes(data, self._shares.parsed.limit))
            operation: dict[str, Any] = bson.decode(data)
        except (bson.error, ValueError, RecursionError) as error:
            raise BadInput(f"not BSON: {printable(error)}") from None
        return operation
