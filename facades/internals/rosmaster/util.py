"""`rosmaster.util`: XML-RPC proxies for nodes and masters."""

from __future__ import annotations

import threading
from xmlrpc.client import ServerProxy

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "errno socket urllib.parse:urlparse")

_proxies = threading.local()
"""Per-thread proxies, because a proxy supports one call at a time."""


def xmlrpcapi(uri: str | None) -> ServerProxy | None:
    """Return an XML-RPC proxy for a node or master, or None if the URI is invalid. Cached per thread."""
    scheme, _, rest = (uri or "").partition("://")
    if uri is None or not scheme or not rest.partition("/")[0]:
        return None
    proxies: dict[str, ServerProxy] = _proxies.__dict__
    return proxies.setdefault(uri, ServerProxy(uri))


def remove_server_proxy(uri: str) -> None:
    """Remove this thread's proxy from the cache of `xmlrpcapi`."""
    _proxies.__dict__.pop(uri, None)


def close_half_closed_sockets() -> None:
    """Do nothing, because a proxy detects a closed connection on its next call, and reconnects."""
