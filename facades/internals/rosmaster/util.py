"""`rosmaster.util`: proxies of nodes and masters."""

from __future__ import annotations

import threading
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "errno socket urllib.parse:urlparse")

_proxies = threading.local()
"""Each thread has its own: a proxy answers one call at a time."""


def xmlrpcapi(uri: str | None) -> ServerProxy | None:
    """An XML-RPC proxy of a node or master; None for what is not a URI. Each thread keeps its own."""
    if uri is None:
        return None
    parts = urlsplit(uri)
    if not parts.scheme or not parts.netloc:
        return None
    proxies: dict[str, ServerProxy] = _proxies.__dict__
    return proxies.setdefault(uri, ServerProxy(uri))


def remove_server_proxy(uri: str) -> None:
    """Forgets the proxy that `xmlrpcapi` keeps for this thread."""
    _proxies.__dict__.pop(uri, None)


def close_half_closed_sockets() -> None:
    """Does nothing: a proxy notices at its next call that the other side has closed, and connects again."""
