"""`roslib.scriptutil`, for legacy scripts: the master, and name resolution for scripts."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar
from xmlrpc.client import ServerProxy

from pipros.net.server_proxy import server_proxy
from rosgraph import names

P = ParamSpec("P")
T = TypeVar("T")


def deprecated(func: Callable[P, T]) -> Callable[P, T]:
    """Wrap a function so that each call issues a DeprecationWarning."""

    @wraps(func)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        warnings.warn(
            f"Call to deprecated function {func.__name__}.", category=DeprecationWarning, stacklevel=2
        )
        return func(*args, **kwargs)

    return call


@deprecated
def get_master() -> ServerProxy:
    """Return an XML-RPC proxy for the master. New code uses `rosgraph.Master`.

    Raises:
        KeyError: `ROS_MASTER_URI` is not set.
    """
    return server_proxy(os.environ["ROS_MASTER_URI"])


@deprecated
def get_param_server() -> ServerProxy:
    """Same as `get_master`, because the master is also the parameter server."""
    return server_proxy(os.environ["ROS_MASTER_URI"])


@deprecated
def script_resolve_name(script_name: str, name: str) -> str:
    """Resolve a name to a global name for a script; see `rosgraph.names.script_resolve_name`."""
    return names.script_resolve_name(script_name, name)
