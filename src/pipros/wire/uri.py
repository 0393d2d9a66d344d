"""Taking URIs of nodes and masters apart. `urllib` would take longer to import than a call to the master."""

from __future__ import annotations


def split_uri(text: str) -> tuple[str, int, str]:
    """Host, port and path of an `http://` URI, the way XML-RPC clients take it apart.

    >>> split_uri("http://robot:11311/RPC2"), split_uri("http://[::1]:11311")
    (('robot', 11311, '/RPC2'), ('::1', 11311, '/'))

    Raises:
        ValueError: for another scheme, without a host or a port, with blanks or control characters, or for a
            host that can be no name.
    """
    scheme, _, rest = text.partition("://")
    address, slash, path = rest.partition("/")
    host, _, port = address.rpartition(":")
    host = host.rpartition("@")[2]
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    is_complete = scheme.lower() in ("http", "rosrpc") and port.isdecimal() and int(port) <= 65535
    if not is_complete or not _can_be_host(host) or not text.isprintable() or " " in text:
        raise ValueError(f"[{repr(text[:200])[1:-1]}] is no URI of the form http://HOST:PORT/")
    return host, int(port), slash + path or "/"


def host_and_port(host: str, port: int) -> str:
    """Both in one, as URIs and the `Host` header of HTTP have them.

    >>> host_and_port("robot", 80), host_and_port("::1", 80)
    ('robot:80', '[::1]:80')
    """
    if ":" in host and not host.startswith("["):
        host = f"[{host}]"
    return f"{host}:{port}"


def _can_be_host(host: str) -> bool:
    """False for what looking up would raise another error for than that nobody knows it."""
    try:
        ascii_host = host if host.isascii() else host.encode("idna").decode("ascii")
    except UnicodeError:
        return False
    is_of_labels = all(0 < len(label) < 64 for label in ascii_host.removesuffix(".").split("."))
    return is_of_labels and "[" not in host
