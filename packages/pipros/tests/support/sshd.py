"""A private ssh server with new keys, on a free port, for the current user only."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.support.ports import ClaimedPort
from tests.support.waiting import wait_until

SSHD = "/usr/sbin/sshd"

_SERVER = """\
Port {port}
ListenAddress {address}
HostKey {folder}/host_key
AuthorizedKeysFile {folder}/.ssh/id_ed25519.pub
StrictModes no
UsePAM no
PasswordAuthentication no
KbdInteractiveAuthentication no
PermitRootLogin prohibit-password
PidFile none
"""

_CLIENT = """\
Host {alias}
  HostName {address}
  Port {port}
  HostKeyAlias [127.0.0.1]:{port}
  IdentityFile {folder}/.ssh/id_ed25519
  UserKnownHostsFile {folder}/.ssh/known_hosts
"""


class SshServer:
    """A server that runs from its creation to `close`.

    Attributes:
        port: the port of the server.
        folder: a home folder. Its `.ssh` contains an accepted key and a `known_hosts` with the server's key.
        log: the output of the server.
    """

    def __init__(self, folder: Path, address: str = "127.0.0.1", prefix: Sequence[str] = ()) -> None:
        """Start the server. `prefix` is put before its command, for example to run it in another network."""
        self.folder = folder
        self.log = folder / "sshd.log"
        keys = folder / ".ssh"
        keys.mkdir(mode=0o700, parents=True)
        for key in (folder / "host_key", keys / "id_ed25519"):
            subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
        self._port = ClaimedPort()
        self.port = self._port.number
        host_key = " ".join((folder / "host_key.pub").read_text().split()[:2])
        (keys / "known_hosts").write_text(f"[127.0.0.1]:{self.port} {host_key}\n")
        config = folder / "sshd_config"
        config.write_text(_SERVER.format(port=self.port, folder=folder, address=address))
        if os.geteuid() == 0:
            Path("/run/sshd").mkdir(mode=0o755, exist_ok=True)  # the chroot folder of the server
        self._process = subprocess.Popen([*prefix, SSHD, "-D", "-f", config, "-E", self.log])
        wait_until(self._is_listening, 60, what=lambda: f"sshd: {self.log.read_text()}")

    def client(self, folder: Path, alias: str, address: str = "127.0.0.1") -> None:
        """Write a program `ssh` to `folder` that connects to this server if its host is `alias`."""
        config = self.folder / "ssh_config"
        config.write_text(_CLIENT.format(alias=alias, address=address, port=self.port, folder=self.folder))
        ssh = folder / "ssh"
        ssh.write_text(f'#!/bin/sh\nexec {shutil.which("ssh")} -F {config} "$@"\n')
        ssh.chmod(0o755)

    def close(self) -> None:
        self._process.terminate()
        self._process.wait(30)
        self._port.release()

    def _is_listening(self) -> bool:
        assert self._process.poll() is None, self.log.read_text()
        return self.log.exists() and "Server listening" in self.log.read_text()
