"""Run a program's node, event loop, port and bridges until the program is stopped."""

from __future__ import annotations

import contextlib
import gc
import ipaddress
import socket
import ssl
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from pipros.basics.errors import PiprosError
from pipros.basics.interruptible_wait import ProgramLife, run_until_signalled
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros.node.start_params import is_on
from pipros_bridges.admission import Admission
from pipros_bridges.bridge_server import BridgeServer
from pipros_bridges.sessions import Handler
from pipros_server.freed_memory import share_one_arena
from pipros_server.loop_share import switch_threads_often
from pipros_server.policy.model import Policy
from pipros_server.secret import Secret
from pipros_server.tls import EVERYWHERE, ServerFailed, fingerprint_of, tls_context
from pipros_server.token_file import read_tokens
from pipros_server.view_server import PageServer

ENDING_S: Final = 0.1
"""Maximum time (s) to wait for remaining tasks after `BridgeOptions.closing_s`."""


@dataclass(frozen=True, slots=True)
class BridgeOptions:
    """The address on which a program listens, and the conditions for its clients.

    Attributes:
        tool: name of the program in its messages.
        host: address to listen on.
        port: port to listen on; 0 selects a free one.
        certificate, key: PEM files for TLS.
        token_file: file with the accepted tokens; None if there is none.
        origins: origins of other pages that may connect; `*` allows all. Pages served from this machine may
            always connect.
        allows_null_origin: whether pages without an origin may connect.
        has_control: whether clients may change the system.
        policy: restricts what clients with control may do; None for no policy.
        closing_s: maximum time to wait at exit for connections, node and protocols together.
    """

    tool: str
    port: int
    host: str = "127.0.0.1"
    certificate: str | None = None
    key: str | None = None
    token_file: str | None = None
    origins: Sequence[str] = ()
    allows_null_origin: bool = False
    has_control: bool = False
    closing_s: float = 0.4
    policy: Policy | None = None

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        host = self.host.strip("[]")
        try:
            return host == "localhost" or ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False

    @property
    def shown_host(self) -> str:
        """The host name to print in addresses."""
        host = self.host.strip("[]")
        if host in ("localhost", "127.0.0.1", "::1"):
            return "localhost"
        return f"[{host}]" if ":" in host else host


class Protocols(Protocol):
    """The protocols that a program serves."""

    @property
    def page(self) -> PageServer | None:
        """The page on the same port, if any."""

    def handlers(self) -> Mapping[str, Handler]:
        """Return the handlers by subprotocol. Called once, before `start`."""

    def start(self) -> None:
        """Start the threads. Called in the event loop, once the port is open."""

    def close(self) -> None:
        """Stop the threads. May be called from any thread."""


def serve(
    node: Node,
    options: BridgeOptions,
    make: Callable[[Node, BackgroundLoop], Protocols],
    secret: Secret | None,
) -> int:
    """Run a node and serve clients until Ctrl-C, SIGTERM or the shutdown of the node.

    Args:
        make: creates the protocols.
        secret: the secret whose token all clients must present; None admits every client.

    Raises:
        ServerFailed: the port is in use, or the certificate cannot be read.
    """
    share_one_arena()
    switch_threads_often()
    run_until_signalled(lambda life: _serve(node, options, make, secret, life))
    return 0


def _serve(
    node: Node,
    options: BridgeOptions,
    make: Callable[[Node, BackgroundLoop], Protocols],
    secret: Secret | None,
    life: ProgramLife,
) -> None:
    admission = Admission(secret, options.origins, options.allows_null_origin)
    tls = tls_context(options.certificate, options.key)
    over = life.over
    loop = BackgroundLoop(options.tool)
    with node:
        node.on_shutdown(over.set)
        with (
            life.interrupted_by(node.shutdown),
            contextlib.suppress(PiprosError),
        ):  # continue without a master
            if is_on(node, "/use_sim_time"):
                node.use_simulated_time()
        if over.is_set():
            return
        loop.start()
        protocols = make(node, loop)
        server = BridgeServer(
            protocols.handlers(),
            admission,
            protocols.page,
            limits=node.limits,
            has_control=options.has_control,
        )
        try:
            loop.run(_open(server, options, protocols, tls))
            gc.freeze()  # these objects live until exit; collecting garbage among them would delay clients
            _announce(options, server.port, protocols.page, secret)
            over.wait()
        except OSError as error:
            reason = error.strerror or error
            raise ServerFailed(f"cannot listen at {options.host}:{options.port}: {reason}") from None
        finally:
            end_s = time.monotonic() + options.closing_s
            endings = [
                threading.Thread(target=end, name=f"end of {what}", daemon=True)
                for what, end in (("the node", node.shutdown), ("the protocols", protocols.close))
            ]
            for ending in endings:
                ending.start()
            with contextlib.suppress(TimeoutError):
                loop.run(server.close(), options.closing_s)
            for ending in endings:
                ending.join(max(end_s - time.monotonic(), 0.0))
            loop.stop(ENDING_S)


def secret_of(options: BridgeOptions) -> Secret | None:
    """Return the secret in the token file, or None if there is no token file.

    Raises:
        BadTokenFile: the tokens cannot be read.
    """
    return Secret(tokens=read_tokens(options.token_file)) if options.token_file is not None else None


async def _open(
    server: BridgeServer, options: BridgeOptions, protocols: Protocols, tls: ssl.SSLContext | None
) -> None:
    shown = options.shown_host
    names = () if shown == "localhost" else (shown.lower(), socket.gethostname().lower())
    await server.open(options.host.strip("[]"), options.port, names=names, tls=tls)
    protocols.start()


def _announce(options: BridgeOptions, port: int, page: PageServer | None, secret: Secret | None) -> None:
    """Print the addresses on stderr, because roslaunch writes the standard output of nodes to files."""
    shown = options.shown_host
    scheme = "ws" if options.certificate is None else "wss"
    if page is not None:
        reachable = "localhost" if options.host in EVERYWHERE else shown
        print(f"{options.tool}: {page.access.url(reachable)}", file=sys.stderr)
    path = "" if secret is None else "/TOKEN" if options.token_file is not None else f"/{secret.token}"
    print(f"{options.tool}: {scheme}://{shown}:{port}{path}", file=sys.stderr, flush=True)
    if not options.has_control:
        more = "change the system" if options.policy is None else "do what the policy permits"
        print(f"Clients can only read. With --control, they can also {more}.", file=sys.stderr)
    if options.is_local:
        return
    if secret is None:
        what = "see and change" if options.has_control else "see"
        how = "~token_file" if options.tool == "foxglove_bridge" else "--token-file"
        print(f"Everyone on this network can {what} the system; {how} limits access.", file=sys.stderr)
    if options.certificate is None:
        print("The connection is not encrypted; --cert and --key encrypt it.", file=sys.stderr)
    elif fingerprint := fingerprint_of(options.certificate):
        print(f"Encrypted with TLS; the certificate's SHA-256 fingerprint is {fingerprint}.", file=sys.stderr)
