"""Serve one assistant over standard input and output.

The library `mcp` reads lines of any length. Here, it gets its lines from `RequestLines`, which limits them.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from typing import Any, BinaryIO, Final

from mcp.os.win32.utilities import rebind_std_handle_to_fd
from mcp.server.mcpserver import MCPServer
from mcp.server.stdio import stdio_server
from mcp.shared.message import SessionMessage
from mcp_types import INVALID_REQUEST, ErrorData, JSONRPCError

ASSISTANT_REQUEST_BYTES = 1024 * 1024
"""Limit: size of an HTTP request, or of a line over standard input. Beyond it, the request is refused:
status 413, or error -32600 over stdio.
"""

_STDIN: Final = 0


async def serve_stdio(server: MCPServer[Any], limit_bytes: int) -> None:
    """Serve until the client closes standard input.

    Until then, `/dev/null` is the standard input of tools and of their child processes.
    """
    wire, null = os.dup(sys.stdin.fileno()), os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, _STDIN)
    os.close(null)
    rebind_std_handle_to_fd(_STDIN)  # which does nothing except on Windows
    # A thread may still read this descriptor afterwards.
    lines = RequestLines(open(wire, "rb", closefd=False), limit_bytes)  # noqa: SIM115
    async with stdio_server(stdin=lines) as (requests, answers):  # type: ignore[arg-type] # it only iterates
        lines.answers.set_result(answers)
        served = server._lowlevel_server
        await served.run(requests, answers, served.create_initialization_options())


class RequestLines:
    """The lines of a file. A line that exceeds the limit is answered with an error, and dropped in parts.

    Attributes:
        answers: the stream that errors are sent to; must be set.
    """

    def __init__(self, file: BinaryIO, limit_bytes: int) -> None:
        self.answers: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._file = file
        self._limit = limit_bytes

    async def __aiter__(self) -> AsyncIterator[str]:
        while True:
            line = await asyncio.to_thread(self._next)
            if line is None:
                await (await self.answers).send(SessionMessage(self._error()))
            elif line:
                yield line.decode("utf-8", "replace")
            else:
                return

    def _next(self) -> bytes | None:
        """Return the next line, which is empty at the end of the file, or None for one that is too long."""
        line = self._file.readline(self._limit + 1)
        if len(line) <= self._limit:
            return line
        while line and not line.endswith(b"\n"):
            line = self._file.readline(self._limit)
        return None

    def _error(self) -> JSONRPCError:
        limit = f"the limit is {self._limit} bytes"
        text = f"the line is too long; {limit}. Send shorter requests"
        return JSONRPCError(jsonrpc="2.0", id=None, error=ErrorData(code=INVALID_REQUEST, message=text))
