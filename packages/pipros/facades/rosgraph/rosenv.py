"""Environment variables that configure the ROS graph."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from pipros.basics.env import DEFAULT_MASTER_PORT as DEFAULT_MASTER_PORT

ROS_MASTER_URI = "ROS_MASTER_URI"
ROS_IP = "ROS_IP"
ROS_IPV6 = "ROS_IPV6"
ROS_HOSTNAME = "ROS_HOSTNAME"
ROS_NAMESPACE = "ROS_NAMESPACE"

DEFAULT_MASTER_URI = f"http://localhost:{DEFAULT_MASTER_PORT}/"


def get_master_uri(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return the master's URI: `__master:=` in `argv`, or else `ROS_MASTER_URI`, or else the default.

    Raises:
        ValueError: `__master:=` has no value, or contains another `:=`.
    """
    env = os.environ if env is None else env
    for argument in sys.argv if argv is None else argv:
        if argument.startswith("__master:="):
            _, _, uri = argument.partition(":=")
            if not uri or ":=" in uri:
                raise ValueError(f"__master remapping argument '{argument}' improperly specified")
            return uri
    return env.get(ROS_MASTER_URI, DEFAULT_MASTER_URI)
