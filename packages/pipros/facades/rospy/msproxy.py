"""A proxy for the master with the methods of its XML-RPC API."""

from __future__ import annotations

import errno
from collections.abc import Callable
from typing import Any

from pipros.basics.errors import NotFound, Unreachable
from pipros.basics.lazy_names import star_names as _star_names
from pipros.net.master_client import MasterClient
from rospy.session import session

_star_names(__name__, "threading:Lock rospy")


class MasterProxy:
    """Proxy for any method of the Master and Parameter API, with `caller_id` as the implicit first argument.

    For example, `proxy.getPid()` returns `[code, text, value]`. Parameters can be used like entries of a
    dictionary: `proxy['~rate'] = 5`. `target` is the underlying client.

    Raises:
        OSError: the master cannot be reached.
    """

    def __init__(self, uri: str) -> None:
        self.target = MasterClient(uri, session.name)

    def __getattr__(self, method: str) -> Callable[..., Any]:
        if method.startswith("_"):
            raise AttributeError(method)

        def call(*args: Any) -> list[Any]:
            self.target.caller_id = session.name
            try:
                return list(self.target.call_raw(method, *args))
            except Unreachable as error:
                raise ConnectionRefusedError(errno.ECONNREFUSED, str(error)) from error

        return call

    def search_param(self, key: str) -> str | None:
        """Return the full name of the closest parameter with the given name, or None.

        The search starts in the node's namespace and continues upwards.
        """
        return session.params.search(key)

    def get_param_cached(self, key: str) -> Any:
        """Return a parameter's value, cached until the master announces a change.

        Raises:
            KeyError: the parameter is not set.
        """
        try:
            return session.params.get_cached(key)
        except NotFound:
            raise KeyError(key) from None

    def __getitem__(self, key: str) -> Any:
        code, _, value = self.getParam(session.resolve(key))
        if code != 1:
            raise KeyError(key)
        return value

    def __setitem__(self, key: str, value: Any) -> None:
        self.setParam(session.resolve(key), value)

    def __delitem__(self, key: str) -> None:
        code, _, _ = self.deleteParam(session.resolve(key))
        if code != 1:
            raise KeyError(key)

    def __contains__(self, key: str) -> bool:
        code, _, value = self.hasParam(session.resolve(key))
        return code == 1 and bool(value)

    def __iter__(self) -> Any:
        _, _, keys = self.getParamNames()
        return iter(keys)
