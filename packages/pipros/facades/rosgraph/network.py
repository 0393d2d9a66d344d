"""Network addresses and connection headers. Facade of `pipros.net.address` and `pipros.wire`."""

from __future__ import annotations

import logging
import os
import socket
import sys
from collections.abc import Mapping
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import ProtocolError
from pipros.basics.names import parse_arguments
from pipros.net import address as _address
from pipros.net.this_machine import is_this_machine, own_address, own_addresses
from pipros.wire.header import HeaderReader, decode_header, encode_header
from rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_IPV6

__all__ = [
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "SIOCGIFADDR",
    "SIOCGIFCONF",
    "ROSHandshakeException",
    "create_local_xmlrpc_uri",
    "decode_ros_handshake_header",
    "encode_ros_handshake_header",
    "get_address_override",
    "get_bind_address",
    "get_host_name",
    "get_local_address",
    "get_local_addresses",
    "is_local_address",
    "logger",
    "parse_http_host_and_port",
    "python3",
    "read_ros_handshake_header",
    "use_ipv6",
    "write_ros_handshake_header",
]


# Linux ioctl() requests that return the list of network interfaces and the address of an interface.
SIOCGIFCONF = 0x8912
SIOCGIFADDR = 0x8915
python3 = 1

logger = logging.getLogger("rosgraph.network")


class ROSHandshakeException(Exception):  # this is Noetic's name
    """A connection header is invalid or was not received."""


def parse_http_host_and_port(url: str) -> tuple[str, int]:
    """Return the host and port of a URL. The port defaults to 80.

    Raises:
        ValueError: `url` is not a valid URL.
    """
    from urllib.parse import urlsplit

    parts = urlsplit(url) if url else None
    if parts is None or not parts.scheme or not parts.hostname:
        raise ValueError("not a valid URL")
    return parts.hostname, parts.port or 80


def get_address_override() -> str | None:
    """Return the name or address set by `__hostname:=`, `__ip:=`, `ROS_HOSTNAME` or `ROS_IP`, or None.

    Invalid values are reported on standard error.
    """
    special = parse_arguments(sys.argv).special
    if argument := special.get("__hostname") or special.get("__ip"):
        return argument
    name = next((name for name in (ROS_HOSTNAME, ROS_IP) if name in os.environ), None)
    if name is None:
        return None
    if problem := _address.problem_of(os.environ[name], is_address=name == ROS_IP):
        sys.stderr.write(f"invalid {name} ({problem})\n")
    return os.environ[name]


def get_host_name() -> str:
    """Return the name or address under which this machine is advertised to other machines."""
    if override := get_address_override():
        return override
    name = socket.gethostname()
    return own_address() if not name or _address.is_loopback(name) else name


def get_local_addresses() -> list[str]:
    """Return this machine's IP addresses, loopback first."""
    return own_addresses()


def get_local_address() -> str:
    """Return the result of `get_address_override`, or else an address that other machines can reach.

    Return a loopback address if neither exists.
    """
    return get_address_override() or own_address()


def is_local_address(hostname: str) -> bool:
    """Return whether a name or address belongs to this machine."""
    return is_this_machine(hostname)


def get_bind_address(address: str | None = None) -> str:
    """Return the address to which a server that clients reach at `address` should bind.

    The default is the same as for pipros nodes: loopback if master and node are local.
    """
    environment = Environment.from_os()
    return _address.bind_host(environment._replace(hostname=address or get_address_override()))


def use_ipv6() -> bool:
    """Return whether the environment variable `ROS_IPV6` is set to `on`."""
    return os.environ.get(ROS_IPV6) == "on"


def create_local_xmlrpc_uri(port: int) -> str:
    """Return the URI for an XML-RPC server on this machine."""
    advertised = Environment.from_os().advertised_address()
    return _address.uri(*(advertised.outside(port) if advertised else (get_host_name(), port)))


def encode_ros_handshake_header(header: Mapping[Any, Any]) -> bytes:
    """Encode a TCPROS connection header, preceded by its length. Keys and values are str, or bytes in UTF-8.

    Raises:
        TypeError: a key or a value is neither str nor bytes.
    """
    return encode_header({_text(key): _text(value) for key, value in header.items()})


def _text(part: object) -> str:
    if isinstance(part, bytes):
        return part.decode()
    if not isinstance(part, str):
        raise TypeError(f"header fields must be str or bytes, got {type(part).__name__}: {part!r}")
    return part


def decode_ros_handshake_header(header_str: bytes) -> dict[str, str]:
    """Return the fields of a length-prefixed connection header.

    Raises:
        ROSHandshakeException: the header is incomplete or invalid.
    """
    size = int.from_bytes(header_str[:4], "little") + 4
    if len(header_str) < size or len(header_str) < 4:
        raise ROSHandshakeException(
            f"Incomplete header. Expected {size + 4} bytes but only have {len(header_str)}"
        )
    try:
        return {key.strip(): value for key, value in decode_header(header_str[4:size]).items()}
    except ProtocolError as error:
        raise ROSHandshakeException(str(error)) from None


def read_ros_handshake_header(sock: socket.socket, b: Any, buff_size: int) -> dict[str, str]:
    """Read a connection header from a socket. Bytes after the header are left in the buffer `b`.

    Raises:
        ROSHandshakeException: the peer closed the connection too early, or the header is invalid or too long.
    """
    reader = HeaderReader()
    data: bytes = b.getvalue()
    try:
        while (fields := reader.feed(data)) is None:
            data = sock.recv(buff_size)
            if not data:
                raise ROSHandshakeException(
                    "connection from sender terminated before handshake header received"
                )
    except ProtocolError as error:
        raise ROSHandshakeException(str(error)) from None
    b.seek(0)
    b.truncate()
    b.write(reader.rest)
    return fields


def write_ros_handshake_header(sock: socket.socket, header: Mapping[Any, Any]) -> int:
    """Send a connection header and return its size in bytes."""
    data = encode_ros_handshake_header(header)
    sock.sendall(data)
    return len(data)
