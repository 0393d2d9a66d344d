"""Drop-in replacement for Noetic's rosgraph: names, network addresses and the master API.

Facade of `pipros.basics.names`, `pipros.net` and `pipros.wire`; see http://docs.ros.org/noetic/api/rosgraph.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.lazy_names import lazy_names as _lazy_names
from rosgraph import names, network, rosenv
from rosgraph.masterapi import Master, MasterError, MasterException, MasterFailure
from rosgraph.masterapi import is_online as is_master_online
from rosgraph.rosenv import (
    ROS_HOSTNAME,
    ROS_IP,
    ROS_IPV6,
    ROS_MASTER_URI,
    ROS_NAMESPACE,
    get_master_uri,
)

__all__ = [
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "Master",
    "MasterError",
    "MasterException",
    "MasterFailure",
    "get_master_uri",
    "is_master_online",
    "myargv",
    "names",
    "network",
    "rosenv",
]


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the arguments that do not contain `:=`. `argv` defaults to the process's arguments."""
    argv = sys.argv if argv is None else argv
    return [argument for argument in argv if ":=" not in argument]


# In Noetic, `import rospy` makes these two modules available as attributes.
__getattr__, __dir__ = _lazy_names(__name__, {}, ("roslogging", "xmlrpc"))
