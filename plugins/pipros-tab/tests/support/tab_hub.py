"""The hub of a browser tab in Python: for unit tests, and for nodes without threads outside of a browser.

`Switch` follows `src/pipros_tab/page/hub.mjs`. The workers of `TabHub` are processes that run a program as
`pipros_tab.program` does in a worker, with a socket in place of the rings.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipros_tab.packets import HEAD, NUMBER, PacketKind, split
from tests.support.environments import REPOSITORY

_FIRST_ACCEPTED = 0x80000000


class Member:
    """A worker, as the switch sees it. `deliver` sends it a packet."""

    def __init__(self, deliver: Callable[[int, int, bytes], object]) -> None:
        self.deliver = deliver
        self.ends: dict[int, tuple[Member, int]] = {}
        self.ports: set[int] = set()
        self.accepted = itertools.count(_FIRST_ACCEPTED)


class Switch:
    """Connects the members, as the hub does."""

    def __init__(self) -> None:
        self._ports: dict[int, Member] = {}
        self._free = iter(range(20_000, 60_000))
        self.handle_process: Callable[[Member, PacketKind, int, bytes], object] = lambda *_: None

    def handle(self, member: Member, kind: PacketKind, end: int, content: bytes) -> None:
        """Handle a packet from a member."""
        if kind is PacketKind.LISTEN:
            member.deliver(
                PacketKind.LISTENING, end, NUMBER.pack(self._open(member, NUMBER.unpack(content)[0]))
            )
        elif kind is PacketKind.CLOSE_PORT:
            member.ports.discard(end)
            self._ports.pop(end, None)
        elif kind is PacketKind.CONNECT:
            self._connect(member, end, content)
        elif kind in (PacketKind.START, PacketKind.SIGNAL):
            self.handle_process(member, kind, end, content)
        elif end in member.ends:
            peer, number = member.ends[end]
            peer.deliver(kind, number, content)
            if kind is PacketKind.RESET:
                member.ends.pop(end, None)
                peer.ends.pop(number, None)

    def remove(self, member: Member) -> None:
        """End the connections of a member, and close its ports."""
        for peer, number in list(member.ends.values()):
            peer.deliver(PacketKind.RESET, number, b"")
            peer.ends.pop(number, None)
        for port in member.ports:
            self._ports.pop(port, None)

    def _open(self, member: Member, wanted: int) -> int:
        port = wanted or next(self._free)
        if port in self._ports:
            return 0
        self._ports[port] = member
        member.ports.add(port)
        return port

    def _connect(self, member: Member, end: int, content: bytes) -> None:
        listener = self._ports.get(NUMBER.unpack(content)[0])
        if listener is None:
            member.deliver(PacketKind.REFUSED, end, b"")
            return
        number = next(listener.accepted)
        member.ends[end], listener.ends[number] = (listener, number), (member, end)
        listener.deliver(PacketKind.ACCEPT, number, content)
        member.deliver(PacketKind.CONNECTED, end, b"")


class MemoryPort:
    """The port of a member in this process (`pipros_tab.network.Port`)."""

    def __init__(self, switch: Switch) -> None:
        self.interrupts = 0
        self.sent: list[PacketKind] = []
        self._switch = switch
        self._received: list[bytes] = []
        self.member = Member(lambda *packet: self._received.append(_packed(*packet)))

    def send(self, kind: int, end: int, content: bytes) -> None:
        self.sent.append(PacketKind(kind))
        self._switch.handle(self.member, PacketKind(kind), end, content)

    def receive(self, timeout_s: float) -> bytes:
        """Return all packets; without any, sleep."""
        if not self._received and timeout_s > 0:
            time.sleep(min(timeout_s, 0.01))
        received, self._received = b"".join(self._received), []
        return received

    def is_interrupted(self) -> bool:
        self.interrupts, before = 0, self.interrupts
        return bool(before)


class SocketPort:
    """One end of a socket that carries packets, for a worker in another process."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._rest = b""
        self._poll = select.poll()
        self._poll.register(sock.fileno(), select.POLLIN)

    def send(self, kind: int, end: int, content: bytes) -> None:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self._sock.sendall(_packed(kind, end, content))

    def receive(self, timeout_s: float) -> bytes:
        """Return all whole packets that have arrived; wait for the first."""
        if not self._poll.poll(timeout_s * 1000):
            return b""
        return self.take()

    def take(self) -> bytes:
        """Read the socket once, and return all whole packets.

        Raises:
            ConnectionResetError: the other end is closed.
        """
        received = self._sock.recv(1 << 20)
        if not received:
            raise ConnectionResetError("the other end is closed")
        self._rest += received
        at = 0
        while at + HEAD.size <= len(self._rest):
            size = HEAD.size + HEAD.unpack_from(self._rest, at)[0]
            if at + size > len(self._rest):
                break
            at += size
        whole, self._rest = self._rest[:at], self._rest[at:]
        return whole

    def is_interrupted(self) -> bool:
        """Return False: the system interrupts processes."""
        return False


class Cable:
    """The hub's end of a socket to a worker, whose end is `there`."""

    def __init__(self) -> None:
        self.sock, self.there = socket.socketpair()
        self.port = SocketPort(self.sock)
        self.member = Member(self.port.send)


class TabProcess(Cable):
    """A program of the tab.

    Attributes:
        output: what it has printed.
    """

    def __init__(self, program: Mapping[str, Any], parent: TabProcess | None = None) -> None:
        super().__init__()
        self.parent = parent
        there = self.there
        module = "tests.support.tab_process"
        command = [sys.executable, "-u", "-m", module, str(there.fileno()), json.dumps(program)]
        self._process = subprocess.Popen(
            command, cwd=REPOSITORY, pass_fds=[there.fileno()], stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        self.pid = self._process.pid
        there.close()
        self.output = ""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        number = self._process.stdout.fileno()
        for text in iter(lambda: os.read(number, 65536).decode(), ""):
            self._show(text)

    def _show(self, text: str) -> None:
        self.output += text
        if self.parent is not None:
            self.parent._show(text)

    @property
    def is_running(self) -> bool:
        return self._process.poll() is None

    def wait(self, timeout_s: float = 60.0) -> int:
        """Wait for the end, and return the exit code."""
        code = self._process.wait(timeout_s)
        self._reader.join(timeout_s)
        return code

    def interrupt(self, number: int = signal.SIGINT) -> None:
        """Interrupt the program, as Ctrl-C does, or send another signal."""
        self._process.send_signal(number)

    def type(self, **typed: str | bool) -> None:
        """Do what a user does in a terminal: `line="ls"`."""
        self.member.deliver(PacketKind.TYPED, 0, json.dumps(typed).encode())

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self.sock.close()


class TabHub:
    """Starts programs and connects them. Use it as a context manager."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._switch = Switch()
        self._switch.handle_process = self._handle_process
        self._started: list[TabProcess] = []
        self._cables: list[Cable] = []
        self._connected: dict[socket.socket, Cable] = {}
        self._is_over = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self, name: str, source: str, *arguments: str) -> TabProcess:
        """Start a script with this source."""
        path = str(self._folder / f"{name}.py")
        return self._start(["python3", path, *arguments], {path: source})

    def run(self, *command: str, folder: Path | None = None) -> TabProcess:
        """Start a command, such as `rostopic list`, in the home folder or another."""
        return self._start(command, {}, folder)

    def connect(self) -> socket.socket:
        """Return the end of a new socket for a worker that others start; see `tests.support.tab_process`."""
        cable = Cable()
        self._cables.append(cable)
        self._connected[cable.sock] = cable
        return cable.there

    def _start(
        self, command: Sequence[str], files: Mapping[str, str], folder: Path | None = None
    ) -> TabProcess:
        environment = {
            "HOME": str(self._folder), "ROS_HOME": str(self._folder), "PIPROS_LOCAL": "off",
            "ROS_MASTER_URI": "http://127.0.0.1:11311/",
        }  # fmt: skip
        program = {"argv": command, "files": files, "env": environment, "folder": str(folder or "")}
        return self._begin(program, None)

    def _begin(self, program: Mapping[str, Any], parent: TabProcess | None) -> TabProcess:
        started = TabProcess(program, parent)
        self._started.append(started)
        self._connected[started.sock] = started
        return started

    def _handle_process(self, member: Member, kind: PacketKind, end: int, content: bytes) -> None:
        if kind is PacketKind.START:
            (parent,) = [each for each in self._started if each.member is member]
            started = self._begin(json.loads(content), parent)
            member.deliver(PacketKind.STARTED, end, NUMBER.pack(started.pid))
        for each in self._started:
            if kind is PacketKind.SIGNAL and each.pid == end and each.is_running:
                each.interrupt(NUMBER.unpack(content)[0])

    def __enter__(self) -> TabHub:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over = True
        self._thread.join()
        for each in self._started:
            each.close()
        for cable in self._cables:
            cable.sock.close()

    def _run(self) -> None:
        while not self._is_over:
            for sock in ready_of(list(self._connected), 0.02):
                cable = self._connected[sock]
                try:
                    packets = list(split(cable.port.take()))
                except OSError:
                    del self._connected[sock]
                    self._switch.remove(cable.member)
                    if isinstance(cable, TabProcess) and cable.parent is not None:
                        code = NUMBER.pack(cable.wait() & 255)
                        cable.parent.member.deliver(PacketKind.ENDED, cable.pid, code)
                    continue
                for packet in packets:
                    self._switch.handle(cable.member, *packet)


def ready_of(socks: Sequence[socket.socket], timeout_s: float) -> list[socket.socket]:
    """Wait until at least one socket can be read, and return all such sockets."""
    poll = select.poll()  # select() refuses numbers above 1023
    by_number = {sock.fileno(): sock for sock in socks}
    for number in by_number:
        poll.register(number, select.POLLIN)
    return [by_number[number] for number, _ in poll.poll(timeout_s * 1000)]


def _packed(kind: int, end: int, content: bytes) -> bytes:
    return HEAD.pack(len(content), kind, end) + content
