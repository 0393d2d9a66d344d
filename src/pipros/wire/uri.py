"""Taking URIs of nodes and masters apart. `urllib` would take longer to import than a call to the master."""

from __future__ import annotations


def split_uri(text: str) -> tuple[str, int, str]:
    """Host, port and path of an `http://` URI, the way XML-RPC clients take it apart.

    >>> split_uri("http://robot:11311/RPC2")
    ('robot', 11311, '/RPC2')

    Raises:
        ValueError: for another scheme, or without a host or a port.
    """
    scheme, _, rest = text.partition("://")
    address, slash, path = rest.partition("/")
    host, _, port = address.rpartition(":")
    host = host.rpartition("@")[2]
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    if scheme.lower() not in ("http", "rosrpc") or not host or not port.isdecimal() or int(port) > 65535:
        raise ValueError(f"[{text[:200]}] is no URI of the form http://HOST:PORT/")
    return host, int(port), slash + path or "/"
