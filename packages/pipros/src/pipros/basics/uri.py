"""Split the URIs of nodes, masters and services.

Does not use `urllib`, because importing it would take longer than a complete call.
"""

from __future__ import annotations

from collections.abc import Collection

from pipros.basics.printable import printable


def split_uri(text: str, schemes: Collection[str] = ("http",)) -> tuple[str, int, str]:
    """Return the host, port and path of a URI, split as XML-RPC clients do.

    Args:
        text: `http://robot:11311/RPC2`, or `rosrpc://robot:34567` for a service.
        schemes: the accepted schemes, in lower case.

    Raises:
        ValueError: the URI has another scheme, lacks a host or port, contains white space or control
            characters, or has a host that cannot be a name or an address.

    >>> split_uri("http://robot:11311/RPC2"), split_uri("rosrpc://[::1]:11311", ["rosrpc"])
    (('robot', 11311, '/RPC2'), ('::1', 11311, '/'))
    """
    scheme, _, rest = text.partition("://")
    address, slash, path = rest.partition("/")
    host, _, port = address.rpartition(":")
    host = host.rpartition("@")[2]
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    is_complete = scheme.lower() in schemes and port.isdecimal() and int(port) <= 65535
    if not is_complete or not _can_be_host(host) or not text.isprintable() or " " in text:
        forms = " or ".join(f"{scheme}://HOST:PORT/" for scheme in schemes)
        raise ValueError(f"a URI must have the form {forms}, got [{printable(text)}]")
    return host, int(port), slash + path or "/"


def host_of(peer: str) -> str:
    """Return the host in a URI or an address, or the whole text if it is neither.

    >>> host_of("http://robot:123/"), host_of("10.0.0.1:5"), host_of("rosrpc://[::1]:80"), host_of("robot")
    ('robot', '10.0.0.1', '::1', 'robot')
    """
    try:
        return split_uri(peer if "://" in peer else f"http://{peer}", ["http", "rosrpc"])[0]
    except ValueError:
        return peer


def host_and_port(host: str, port: int) -> str:
    """Return `host:port` as in URIs and the HTTP `Host` header.

    >>> host_and_port("robot", 80), host_and_port("::1", 80)
    ('robot:80', '[::1]:80')
    """
    if ":" in host and not host.startswith("["):
        host = f"[{host}]"
    return f"{host}:{port}"


def _can_be_host(host: str) -> bool:
    """Return whether a host is well-formed. Looking up a malformed host would raise an unexpected error."""
    try:
        ascii_host = host if host.isascii() else host.encode("idna").decode("ascii")
    except UnicodeError:
        return False
    is_of_labels = all(0 < len(label) < 64 for label in ascii_host.removesuffix(".").split("."))
    return is_of_labels and "[" not in host
