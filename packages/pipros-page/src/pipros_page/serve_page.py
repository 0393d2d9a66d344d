"""The program behind `rqt_graph` and the other rqt commands: runs a node and a server, and opens the page."""

from __future__ import annotations

import contextlib
import socket
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pipros.basics.interruptible_wait import ProgramLife, run_until_signalled
from pipros.basics.limits import process_limits
from pipros.net.loop import BackgroundLoop
from pipros.node import Node
from pipros_page.bags.folder import BagFolder
from pipros_page.bags.recording import BagRecording
from pipros_page.bags.redirection import BagRedirection
from pipros_page.bags.rewind import RecentMessages
from pipros_page.limits import PageLimits
from pipros_page.scene.layout_file import SceneFile
from pipros_page.scene.services import serve_scene_file
from pipros_page.tabs import BY_POLICY, CHANGING, CONTROLS, OF_MESSAGES, PageContext, views_of_tabs
from pipros_page.watched_system import MASTER_DEADLINE_S, WatchedSystem
from pipros_server.access import Access
from pipros_server.act_gate import ActGate
from pipros_server.desktop import open_in_browser
from pipros_server.freed_memory import share_one_arena
from pipros_server.loop_share import switch_threads_often
from pipros_server.policy.model import Policy
from pipros_server.secret import Secret
from pipros_server.tls import EVERYWHERE, ServerFailed, fingerprint_of, tls_context
from pipros_server.token_file import read_tokens
from pipros_server.view_server import PageServer, ServedViews
from pipros_tools.graph.client import GraphClient

PAGE_REWIND_S = 60.0
"""Limit: the time span for which a page keeps messages for its browsers. Beyond it, older messages are
dropped from the recording for rewinding; `--rewind` takes precedence.
"""

CLOSING_S = 0.4
ENDING_S = 0.1
"""Maximum times (s) to wait at exit: `CLOSING_S` for connections, then `ENDING_S` for remaining tasks."""

PAGES = ("pipros_page", "pipros_server")
"""The packages whose `page` folders contain the page's files."""


@dataclass(frozen=True, slots=True)
class PageOptions:
    """Options for the page's server.

    Attributes:
        tool: command name, from which the node's name is derived.
        tab: tab to open, with its argument: `plot/battery_topic/level`.
        host: address to listen on.
        port: port to listen on; 0 for a free port.
        certificate, key: PEM files for TLS.
        token_file: file with the accepted tokens; None to create a new token.
        permitted: the views and actions in `CHANGING` that the page may use.
        saves_layouts: whether browsers may store layouts of panels, and notes beside bags.
        opens_browser: whether to open the page in a browser if there is a display.
        argv: remappings of the page's node.
        scene: the file shown in the Scene tab; if given, the node offers rviz's services.
        bags: the folder whose bags browsers may open.
        rewind_s: time span (s) that is recorded for browsers; None for `PAGE_REWIND_S`.
        policy: restricts what browsers may do with `permitted`; None for no policy.
    """

    tool: str = "rqt_graph"
    tab: str = "graph"
    host: str = "127.0.0.1"
    port: int = 0
    certificate: str | None = None
    key: str | None = None
    token_file: str | None = None
    permitted: frozenset[str] = frozenset()
    saves_layouts: bool = True
    opens_browser: bool = True
    argv: tuple[str, ...] = ()
    scene: SceneFile | None = None
    bags: str | None = None
    rewind_s: float | None = None
    policy: Policy | None = None


def serve_page(options: PageOptions) -> int:
    """Serve the page until Ctrl-C or SIGTERM. A second signal ends the process immediately.

    Raises:
        ServerFailed: the port is in use, or the certificate cannot be read.
        BadTokenFile: the tokens cannot be read.
    """
    secret = Secret(tokens=read_tokens(options.token_file) if options.token_file is not None else ())
    share_one_arena()
    switch_threads_often()
    run_until_signalled(lambda life: _serve(options, secret, life))
    return 0


def _serve(options: PageOptions, secret: Secret, life: ProgramLife) -> None:
    loop = BackgroundLoop(options.tool)
    with (
        GraphClient(options.tool, timeout_s=MASTER_DEADLINE_S) as graph,
        Node(options.tool, anonymous=True, argv=options.argv) as node,
    ):
        loop.start()
        gate = ActGate(node, options.policy)
        gate.start()
        system = WatchedSystem(graph, node, gate, recent=_recent(options.rewind_s))
        bags = BagFolder(options.bags) if options.bags is not None else None
        recording = BagRecording(bags) if bags is not None else None
        views = served_views(
            system,
            options.permitted,
            options.scene,
            saves_layouts=options.saves_layouts,
            bags=bags,
            recording=recording,
        )
        server = PageServer(views, secret)
        try:
            with life.interrupted_by(node.shutdown):
                if options.scene is not None:
                    serve_scene_file(node, options.scene, may_save="scene_save" in options.permitted)
                loop.run(_start(options, system, server))
            life.over.wait()
        except OSError as error:
            raise ServerFailed(
                f"cannot listen at {options.host}:{options.port}: {error.strerror or error}"
            ) from None
        finally:
            with contextlib.suppress(TimeoutError):
                loop.run(server.close(), CLOSING_S)
            gate.close()
            system.close()
            loop.stop(ENDING_S)
            if recording is not None:
                recording.stop()


def _recent(rewind_s: float | None) -> RecentMessages | None:
    limits = process_limits().of(PageLimits)
    span_s = PAGE_REWIND_S if rewind_s is None else rewind_s
    return RecentMessages(span_s, limits.page_rewind_bytes) if span_s else None


class MountedPage:
    """The page, served on the port of another plugin's server; see `Plugin.offers`.

    Attributes:
        server: answers the requests.
    """

    def __init__(
        self, node: Node, tool: str, secret: Secret | None, gate: ActGate, *, has_control: bool
    ) -> None:
        """Create the page of a node.

        Args:
            tool: the name of the tool; see `GraphClient`.
            secret: the page's secret; None to create a new secret.
            gate: allows or refuses the browsers' acts.
            has_control: whether the page may use all views and actions in `CHANGING`.
        """
        self._closing = contextlib.ExitStack()
        graph = self._closing.enter_context(GraphClient(tool, timeout_s=MASTER_DEADLINE_S))
        self._system = WatchedSystem(graph, node, gate, recent=_recent(None))
        self.server = PageServer(
            served_views(self._system, frozenset(CHANGING if has_control else ())), secret
        )

    def start(self) -> None:
        """Start the threads."""
        self._system.start()

    def close(self) -> None:
        """Stop the threads. May be called from any thread."""
        self._system.close()
        self._closing.close()


async def _start(options: PageOptions, system: WatchedSystem, server: PageServer) -> None:
    system.start()
    host = options.host.strip("[]")
    shown = "localhost" if host in ("127.0.0.1", "::1") else f"[{host}]" if ":" in host else host
    names = () if shown == "localhost" else (shown.lower(), socket.gethostname().lower())
    await server.start(host, options.port, names=names, tls=tls_context(options.certificate, options.key))
    reachable = "localhost" if host in EVERYWHERE else shown
    # Print to stderr: roslaunch writes nodes' standard output to files, and the address contains the token.
    print(f"{options.tool}: {server.access.url(reachable, options.tab)}", file=sys.stderr, flush=True)
    if options.permitted != CHANGING.keys():
        print(_restriction(options.permitted, options.policy), file=sys.stderr)
    if shown != "localhost":
        _warn_about_network(options, server.access)
    if options.opens_browser:
        open_in_browser(server.access, reachable, options.tab)


def _restriction(permitted: frozenset[str], policy: Policy | None) -> str:
    if not permitted:
        more = "change the system" if policy is None else "do what the policy permits"
        return f"The page is read-only. With --control, it can also {more}."
    what = " and ".join(sorted({CHANGING[name] for name in permitted}))
    return f"The page can {what}. With --control, it can make all changes; with --read-only, none."


def served_views(
    system: WatchedSystem,
    permitted: frozenset[str] = frozenset(),
    scene_file: SceneFile | None = None,
    *,
    saves_layouts: bool = False,
    bags: BagFolder | None = None,
    recording: BagRecording | None = None,
) -> ServedViews:
    """Return all views and actions of the page.

    For `permitted`, `saves_layouts` and `bags`, see `PageOptions`. `recording` writes to `bags`.
    """
    if system.gate.policy is not None:
        permitted &= BY_POLICY
    context = PageContext(system, scene_file, saves_layouts, bags, recording)
    of_tabs = views_of_tabs(context)

    async def about(_: Mapping[str, object]) -> Any:
        uri = system.graph.environment.master_uri
        return {
            "master": uri,
            "node": system.node.name,
            "control": permitted == CHANGING.keys(),
            "may": sorted(permitted),
            "can": CHANGING,
            "controls": CONTROLS,
            "of_messages": sorted(OF_MESSAGES),
            "smooth": scene_file is None or scene_file.is_smooth,
        }

    redirection = BagRedirection(
        context.open_bags,
        of_tabs,
        lambda bag: views_of_tabs(PageContext(bag), only_messages=True),
        OF_MESSAGES,
    )
    actions = {**redirection.actions(), "about": about}
    return ServedViews(redirection.views(), actions, frozenset(CHANGING), permitted, PAGES)


def _warn_about_network(options: PageOptions, access: Access) -> None:
    what = "see and change" if options.permitted else "see"
    print(f"Others on this network can {what} the system if they have this address.", file=sys.stderr)
    if options.host.strip("[]") in EVERYWHERE:
        print(f"From other computers: {access.url(socket.gethostname(), options.tab)}", file=sys.stderr)
    if options.certificate is None:
        print("The connection is not encrypted; --cert and --key encrypt it.", file=sys.stderr)
    elif fingerprint := fingerprint_of(options.certificate):
        print(f"Encrypted with TLS; the certificate's SHA-256 fingerprint is {fingerprint}.", file=sys.stderr)
