"""The two variables that every tool reads: `ROS_MASTER_URI` and `ROS_NAMESPACE`.

`env.py`, which reads all variables, is a separate module, because importing it takes as long as a complete
run of a tool such as `rosnode list`.
"""

from __future__ import annotations

from collections.abc import Mapping

from pipros.basics.errors import PiprosError
from pipros.basics.uri import split_uri

DEFAULT_MASTER_PORT = 11311
DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}"


class InvalidEnvironment(PiprosError, ValueError):
    """An environment variable has an invalid value."""


def master_uri_of(variables: Mapping[str, str]) -> str:
    # Blanks, as nodes of Noetic: `set ROS_MASTER_URI=http://robot:11311 && rosrun ...` of Windows leaves one.
    return (variables.get("ROS_MASTER_URI") or "").strip() or DEFAULT_MASTER_URI


def namespace_of(variables: Mapping[str, str]) -> str:
    """Return `ROS_NAMESPACE` with a leading and trailing slash; `/` if unset."""
    namespace = (variables.get("ROS_NAMESPACE") or "").strip("/")
    return f"/{namespace}/" if namespace else "/"


def split_master_uri(uri: str) -> tuple[str, int]:
    """Return the host and port of a master URI.

    Raises:
        InvalidEnvironment: the scheme is not http, or the host or port is missing or invalid.
    """
    try:
        host, port, _ = split_uri(uri)
    except ValueError:
        host, port = "", 0
    if not host or not port:
        raise InvalidEnvironment(
            f"ROS_MASTER_URI [{uri}] must have the form http://HOST:PORT, for example {DEFAULT_MASTER_URI}"
        )
    return host, port
