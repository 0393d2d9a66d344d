"""`rosmaster.util`: XML-RPC proxies for nodes and masters."""

from __future__ import annotations

import threading
from xmlrpc.client import ServerProxy

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.limits import process_limits
from pipros.net.server_proxy import server_proxy

_star_names(__name__, "errno socket urllib.parse:urlparse")

_proxies = threading.local()
"""Per-thread proxies, because a proxy supports one call at a time."""


def xmlrpcapi(uri: str | None) -> ServerProxy | None:
    """Return an XML-RPC proxy for a node or master, or None if the URI is invalid.

    Proxies are cached per thread. A call raises TimeoutError if the server is silent for longer
    than `pipros.Limits.notice_s`.
    """
    scheme, _, rest = (uri or "").partition("://")
    if uri is None or not scheme or not rest.partition("/")[0]:
        return None
    proxies: dict[str, ServerProxy] = _proxies.__dict__
    if uri not in proxies:
        proxies[uri] = server_proxy(uri, process_limits().notice_s)
    return proxies[uri]


def remove_server_proxy(uri: str) -> None:
    """Remove this thread's proxy from the cache of `xmlrpcapi`."""
    _proxies.__dict__.pop(uri, None)


def close_half_closed_sockets() -> None:
    """Do nothing, because a proxy detects a closed connection on its next call, and reconnects."""
