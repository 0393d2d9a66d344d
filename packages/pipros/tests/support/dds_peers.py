"""Peers on Fast DDS and Cyclone DDS, compiled once per machine. Those of each test run in a separate network.

`python -m tests.support.dds_peers` prints the Debian packages that they need. With the argument `wheel`, it
prints the packages from PyPI.
"""

import importlib.util
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environments import SOURCE_PATH, file_of_tests
from tests.support.network import LoneNetwork
from tests.support.once import machine_folder, make_once
from tests.support.processes import Process, Processes

PACKAGES = "cyclonedds-dev cyclonedds-tools g++ libfastcdr-dev libfastrtps-dev tshark"
WHEEL = "cyclonedds==11.0.1" if sys.version_info < (3, 14) and platform.machine() == "x86_64" else ""
"""The newest Cyclone DDS; empty if PyPI has no wheel for this platform."""
INSTALL = f"apt-get install --no-install-recommends {PACKAGES}"
MESSAGE = "example_interfaces::msg::dds_::Blob_"
SERVICE = "example_interfaces::srv::dds_::AddTwoInts"
ACTION = "example_interfaces::action::dds_::Fibonacci"
DOMAIN = "1"

_LOCALHOST = (
    "<General><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    '<Peers><Peer address="localhost"/></Peers></Discovery>'
)
_FILES = {
    "/usr/include/fastrtps/Domain.h": "libfastrtps-dev",
    "/usr/include/fastcdr/Cdr.h": "libfastcdr-dev",
    "/usr/include/dds/dds.h": "cyclonedds-dev",
}
_PROGRAMS = {"idlc": "cyclonedds-tools", "g++": "g++", "tshark": "tshark"}


def missing() -> list[str]:
    """Return the missing packages."""
    files = [package for file, package in _FILES.items() if not Path(file).exists()]
    if WHEEL and importlib.util.find_spec("cyclonedds") is None:
        files.append(f"{WHEEL} (PyPI)")
    return files + [package for program, package in _PROGRAMS.items() if shutil.which(program) is None]


def fast_peer() -> Path:
    """Return the path of the peer on Fast DDS. The first call on a machine compiles it."""
    source = file_of_tests("support/dds/fast_peer.cpp")
    program = machine_folder("fast_peer", [source]) / "fast_peer"

    def make() -> None:
        libraries = ("-lfastrtps", "-lfastcdr", "-pthread")
        subprocess.run(["g++", "-O1", "-o", program, source, *libraries], check=True)

    make_once(program.parent, make)
    return program


def cyclone_peer() -> Path:
    """Return the path of the peer on Cyclone DDS. The first call on a machine compiles it."""
    source, types = file_of_tests("support/dds/cyclone_peer.c"), file_of_tests("support/dds/peer.idl")
    folder = machine_folder("cyclone_peer", [source, types])

    def make() -> None:
        subprocess.run(["idlc", "-x", "final", types], check=True, cwd=folder)
        made = ("gcc", "-O1", "-I.", "-o", "cyclone_peer", source, "peer.c", "-lddsc")
        subprocess.run(made, check=True, cwd=folder)

    make_once(folder, make)
    return folder / "cyclone_peer"


def enable_multicast(network: LoneNetwork) -> None:
    """Let the programs in a network without other machines find each other by multicast."""
    for words in (
        ("ip", "link", "set", "lo", "multicast", "on"),
        ("ip", "route", "add", "224.0.0.0/4", "dev", "lo"),
    ):
        subprocess.run(network.command(*words), check=True)


class Peers:
    """Starts peers of all kinds, and other programs, in a separate network."""

    def __init__(self, processes: Processes) -> None:
        self._processes = processes
        self._network = LoneNetwork("127.0.0.1 localhost\n")
        enable_multicast(self._network)

    def start(self, kind: str, mode: str, name: str, *words: object) -> Process:
        """Start a peer.

        Args:
            kind: `fast-udp`, `fast-shm`, `cyclone` (0.10), `cyclone-localhost` (0.10 without multicast, as
                rmw_cyclonedds configures it for LOCALHOST), `cyclone-wheel` (11), or, for a peer on pipros,
                the discovery range, such as `SUBNET`.
            mode: `pub`, `sub`, `server`, `client`, `action-server` or `action-client`.
            name: the topic, service or action.
            words: the other arguments of the peer's command line.
        """
        dds_type = {"pub": MESSAGE, "sub": MESSAGE, "server": SERVICE, "client": SERVICE}.get(mode, ACTION)
        if kind.startswith("fast"):
            argv = [str(fast_peer()), DOMAIN, kind.partition("-")[2], mode, name, dds_type, *words]
        elif kind == "cyclone-wheel":
            argv = [
                sys.executable, file_of_tests("support/dds/cyclone_wheel_peer.py"), DOMAIN, mode, name,
                *words,
            ]  # fmt: skip
        elif kind.startswith("cyclone"):
            argv = [str(cyclone_peer()), DOMAIN, mode, name, *words]
        else:
            argv = [
                sys.executable, file_of_tests("support/dds/rtps_peer.py"), DOMAIN, kind, mode, name, dds_type,
                *words,
            ]  # fmt: skip
        # Programs that were killed leave files in the shared memory, which all networks have in common.
        private = ["sh", "-c", 'mount -t tmpfs shm /dev/shm && exec "$@"', "sh"]
        command = self._network.command(*(private if kind.startswith("fast") else []), *map(str, argv))
        environment = {"PYTHONPATH": SOURCE_PATH}
        if kind == "cyclone-localhost":
            environment["CYCLONEDDS_URI"] = _LOCALHOST
        return self._processes.start(*command, stdin=subprocess.PIPE, environment=environment)

    def run(self, *argv: object) -> Process:
        """Start any program in the network."""
        return self._processes.start(*self._network.command(*map(str, argv)))

    def close(self) -> None:
        self._processes.end_all()
        self._network.close()


@pytest.fixture
def peers(processes: Processes) -> Iterator[Peers]:
    started = Peers(processes)
    yield started
    started.close()


if __name__ == "__main__":
    print(WHEEL if sys.argv[1:] == ["wheel"] else PACKAGES)
