"""A laser scanner that speaks SCIP 2 on a TCP port of loopback. Shares no code with the driver."""

import contextlib
import select
import socket
import struct
import threading
import time
from collections.abc import Callable

Echoes = list[tuple[int, int]]
"""The echoes of a step: distances in mm, and intensities."""

PARAMETERS = {"MODL": "UST-10LX", "DMIN": "20", "DMAX": "30000", "ARES": "1440", "AMIN": "0"}
PARAMETERS |= {"AMAX": "1080", "AFRT": "540", "SCAN": "2400"}
VERSION = {"VEND": "Hokuyo Automatic Co., Ltd.", "PROD": "UST-10LX", "FIRM": "1.0.0", "PROT": "SCIP 2.2"}
VERSION |= {"SERI": "H1234567"}
STATE = {"MODL": "UST-10LX", "LASR": "ON", "SCSP": "2400", "MESM": "Measuring", "SBPS": "Ethernet 100"}
STATE |= {"TIME": "000000", "STAT": "Stable 000 no error."}
LINE = 64


def with_check(text: str) -> str:
    """Append the checksum of a line."""
    return text + chr((sum(text.encode()) & 0x3F) + 0x30)


def encoded(value: int, count: int = 3) -> str:
    """Return a value as `count` characters of 6 bits."""
    return "".join(chr((value >> 6 * at & 0x3F) + 0x30) for at in reversed(range(count)))


def block(echo: str, status: str, *lines: str) -> bytes:
    """Return a reply, in which the status and all lines get checksums."""
    return "\n".join([echo, *map(with_check, (status, *lines)), "", ""]).encode()


def texts(echo: str, values: dict[str, str]) -> bytes:
    """Return a reply with keys and values, whose checksums leave out the semicolon."""
    lines = (f"{key}:{value}" for key, value in values.items())
    return "\n".join([echo, "00P", *(f"{each};{with_check(each)[-1]}" for each in lines), "", ""]).encode()


def scan_block(echo: str, status: str, clock_ms: int, steps: list[Echoes], *, is_intense: bool) -> bytes:
    """Return a scan. More than one echo of a step is sent as the commands for several echoes have it."""
    data = ""
    for step in steps:
        for number, (distance_mm, intensity) in enumerate(step or [(0, 0)]):
            data += "&" * bool(number) + encoded(distance_mm) + encoded(intensity) * is_intense
    lines = [data[at : at + LINE] for at in range(0, len(data), LINE)]
    return block(echo, status, encoded(clock_ms, 4), *lines)


class SimulatedUrg:
    """A device with one connection at a time.

    Attributes:
        port: its TCP port, the same after `unplug` and `plug_in`.
        commands: what it received.
        scene: returns the echoes of a step.
        lacks: the first two letters of commands that it does not know.
        is_silent, garbage: faults: it sends no scans; it sends these bytes instead.
        clock_ms: the time of the device when it was made.
    """

    def __init__(
        self, scene: Callable[[int], Echoes], *, lacks: tuple[str, ...] = (), period_s: float = 0.025
    ) -> None:
        self.scene, self.lacks, self.period_s = scene, lacks, period_s
        self.commands: list[str] = []
        self.is_silent, self.garbage = False, b""
        self.clock_ms = (1 << 24) - 2000  # it begins again soon
        self._began_s = time.monotonic()
        self.port = 0
        self._is_out = threading.Event()
        self._connection: socket.socket | None = None
        self.plug_in()

    def plug_in(self) -> None:
        """Listen on the port."""
        self._is_out.clear()
        self._listener = socket.create_server(("127.0.0.1", self.port))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Reset the connection, and refuse new ones."""
        self._is_out.set()
        self._thread.join()
        self._listener.close()

    def reset(self) -> None:
        """Reset the connection; another one is accepted at once."""
        if self._connection is not None:
            self._connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._connection.shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        while not self._is_out.is_set():
            if select.select([self._listener], [], [], 0.02)[0]:
                connection, _ = self._listener.accept()
                self._connection = connection
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with connection, contextlib.suppress(OSError):
                    self._serve(connection)
                self._connection = None

    def _serve(self, connection: socket.socket) -> None:
        buffer, stream, due_s = b"", "", 0.0
        while not self._is_out.is_set():
            wait_s = max(0.0, min(due_s - time.monotonic(), 0.02)) if stream else 0.02
            if select.select([connection], [], [], wait_s)[0]:
                received = connection.recv(4096)
                if not received:
                    return
                *lines, buffer = (buffer + received).split(b"\n")
                for line in lines:
                    command = line.decode()
                    self.commands.append(command)
                    stream = self._answer(connection, command, stream)
                    due_s = time.monotonic() + self.period_s
            if stream and not self.is_silent and time.monotonic() >= due_s:
                due_s += self.period_s
                connection.sendall(self.garbage or self._scan(stream, "99"))
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def _answer(self, connection: socket.socket, command: str, stream: str) -> str:
        """Reply to a command, and return the command of the stream that runs afterwards."""
        kind = command[:2]
        if kind in self.lacks:
            connection.sendall(block(command, "0E"))
            return stream
        if kind in ("MD", "ME", "ND", "NE"):
            connection.sendall(block(command, "00"))
            return command
        replies = {
            "QT": lambda: block(command, "00"), "BM": lambda: block(command, "02" if stream else "00"),
            "PP": lambda: texts(command, PARAMETERS), "VV": lambda: texts(command, VERSION),
            "II": lambda: texts(command, STATE),
            "TM": lambda: block(command, "00", *([encoded(self._now_ms(), 4)] if command == "TM1" else [])),
            "GD": lambda: self._scan(command, "00"), "GE": lambda: self._scan(command, "00"),
        }  # fmt: skip
        connection.sendall(replies[kind]() if kind in replies else block(command, "0E"))
        return "" if kind in ("QT", "TM") else stream

    def _now_ms(self) -> int:
        return int(self.clock_ms + (time.monotonic() - self._began_s) * 1000) % (1 << 24)

    def _scan(self, command: str, status: str) -> bytes:
        first, last, cluster = int(command[2:6]), int(command[6:10]), int(command[10:12])
        steps = [self.scene(step) for step in range(first, last + 1, max(cluster, 1))]
        if command[0] in "MG":
            steps = [each[:1] for each in steps]
        return scan_block(command, status, self._now_ms(), steps, is_intense=command[1] == "E")
