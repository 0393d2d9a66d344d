"""A second network on this machine, behind a cable that can be cut: a network namespace of Linux."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys

import pytest


def is_available() -> bool:
    """True where namespaces can be made: on Linux, as root, with the `ip` command."""
    if sys.platform != "linux" or os.geteuid() != 0 or shutil.which("ip") is None:
        return False
    name = f"pipros-try-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False)
    subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)
    return made.returncode == 0


needs_network = pytest.mark.skipif(not is_available(), reason="needs network namespaces, which need root")


class FarNetwork:
    """A network of two hosts: this machine as `near`, and `far`, where programs are run by `command`."""

    def __init__(self) -> None:
        number = random.randrange(1 << 16)  # noqa: S311 - a free number, not a secret
        subnet = f"10.213.{number // 256}"
        first = number % 64 * 4
        self.near, self.far = f"{subnet}.{first + 1}", f"{subnet}.{first + 2}"
        self._name, self._cable = f"pipros-{number}", f"pip{number}"
        _ip("netns", "add", self._name)
        try:
            plug = ("type", "veth", "peer", "name", "far0", "netns", self._name)
            _ip("link", "add", self._cable, *plug)
            _ip("address", "add", f"{self.near}/30", "dev", self._cable)
            _ip("link", "set", self._cable, "up")
            _ip("-n", self._name, "link", "set", "lo", "up")
            _ip("-n", self._name, "link", "set", "far0", "up")
            self.mend()
        except BaseException:
            self.close()
            raise

    def command(self, *argv: str) -> list[str]:
        """The command line that runs a program on the far side."""
        return ["ip", "netns", "exec", self._name, *argv]

    def cut(self) -> None:
        """From now on nothing arrives on either side, and nobody is told."""
        _ip("-n", self._name, "address", "delete", f"{self.far}/30", "dev", "far0")

    def mend(self) -> None:
        _ip("-n", self._name, "address", "add", f"{self.far}/30", "dev", "far0")

    def close(self) -> None:
        subprocess.run(["ip", "link", "delete", self._cable], capture_output=True, check=False)
        subprocess.run(["ip", "netns", "delete", self._name], capture_output=True, check=False)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True)
