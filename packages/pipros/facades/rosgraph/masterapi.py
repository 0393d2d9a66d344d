"""The master API as Python methods: `rosgraph.Master("/name").getSystemState()`.

Facade of `pipros.net.master_client.MasterClient`. Raises the same exceptions as Noetic: `MasterError` for
invalid calls, `MasterFailure` for failures of the master, and `socket.error` if the master cannot be reached.
"""

from __future__ import annotations

from typing import Any, cast

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.net.master_client import MasterClient
from pipros.wire.xmlrpc import Fault
from rosgraph.names import make_caller_id
from rosgraph.network import parse_http_host_and_port
from rosgraph.rosenv import get_master_uri


class MasterException(Exception):  # this is Noetic's name
    """Base class of the errors that the master returns."""


class MasterError(MasterException):
    """The master rejected the call (code -1)."""


class MasterFailure(MasterException):
    """The call failed on the master (code 0)."""


ROSMasterException = MasterException
Error = MasterError
Failure = MasterFailure


def is_online(master_uri: str | None = None) -> bool:
    """Return whether a master responds at `master_uri`, which defaults to `ROS_MASTER_URI`."""
    return Master("rosgraph", master_uri=master_uri).is_online()


class Master:
    """The Master API and the Parameter Server API, as methods with the same names.

    Each method blocks until the master has responded, and returns only the value. Errors: `MasterError`,
    `MasterFailure`, `socket.error` or `xmlrpc.client.Fault`.

    Attributes:
        client: the underlying client (not in Noetic).
    """

    def __init__(self, caller_id: str, master_uri: str | None = None) -> None:
        """Set up the client, without connecting. `master_uri` defaults to `ROS_MASTER_URI`.

        Raises:
            ValueError: `master_uri` is not a valid URI.
        """
        if master_uri is None:
            master_uri = get_master_uri()
        self.caller_id = make_caller_id(caller_id).rstrip("/") or "/"
        self._reinit(master_uri)

    def _reinit(self, master_uri: str) -> None:
        self._handle: Any = None
        try:
            host, port = parse_http_host_and_port(master_uri)
            self.client = MasterClient(f"http://{_bracketed(host)}:{port}/", self.caller_id)
        except ValueError:
            raise ValueError(f"invalid master URI: {master_uri}") from None
        self.master_uri = master_uri

    @property
    def handle(self) -> Any:
        """An `xmlrpc.client.ServerProxy` for the master, for methods that this class does not have.

        If this is set to another object, all calls go to that object, with the caller ID first:
        `getPid("/me")`.
        """
        if self._handle is not None:
            return self._handle
        from pipros.net.server_proxy import server_proxy

        return server_proxy(self.master_uri)

    @handle.setter
    def handle(self, value: Any) -> None:
        self._handle = value

    def _call(self, method: str, *params: Any) -> Any:
        if self._handle is not None:
            return self._succeed(getattr(self._handle, method)(self.caller_id, *params))
        try:
            response = self.client.call_raw(method, *params)
        except Unreachable as error:
            raise error.__cause__ or ConnectionError(str(error)) from None
        except Fault as error:
            from xmlrpc.client import Fault as ClientFault

            raise ClientFault(error.code, error.text) from None
        except ProtocolError as error:
            raise MasterFailure(str(error)) from None
        return self._succeed(response)

    def _succeed(self, args: Any) -> Any:
        """Return the value of a response `[code, text, value]`. Raise an exception if the code is not 1."""
        code, text, value = args
        if code == 1:
            return value
        raise (MasterError if code == -1 else MasterFailure)(text)

    def is_online(self) -> bool:
        """Return whether the master responds correctly."""
        try:
            self.getPid()
        except (OSError, MasterException, TypeError, ValueError):
            return False
        return True

    def getPid(self) -> int:  # the methods have the same names as in the API
        return cast(int, self._call("getPid"))

    def getUri(self) -> str:
        return cast(str, self._call("getUri"))

    def registerService(self, service: str, service_api: str, caller_api: str) -> int:
        return cast(int, self._call("registerService", service, service_api, caller_api))

    def unregisterService(self, service: str, service_api: str) -> int:
        return cast(int, self._call("unregisterService", service, service_api))

    def registerSubscriber(self, topic: str, topic_type: str, caller_api: str) -> Any:
        return self._call("registerSubscriber", topic, topic_type, caller_api)

    def unregisterSubscriber(self, topic: str, caller_api: str) -> int:
        return cast(int, self._call("unregisterSubscriber", topic, caller_api))

    def registerPublisher(self, topic: str, topic_type: str, caller_api: str) -> Any:
        return self._call("registerPublisher", topic, topic_type, caller_api)

    def unregisterPublisher(self, topic: str, caller_api: str) -> int:
        return cast(int, self._call("unregisterPublisher", topic, caller_api))

    def lookupNode(self, node_name: str) -> str:
        return cast(str, self._call("lookupNode", node_name))

    def lookupService(self, service: str) -> str:
        return cast(str, self._call("lookupService", service))

    def getTopicTypes(self) -> Any:
        return self._call("getTopicTypes")

    def getPublishedTopics(self, subgraph: str) -> Any:
        return self._call("getPublishedTopics", subgraph)

    def getSystemState(self) -> Any:
        return self._call("getSystemState")

    def getParam(self, key: str) -> Any:
        return self._call("getParam", key)

    def setParam(self, key: str, value: Any) -> int:
        return cast(int, self._call("setParam", key, value))

    def hasParam(self, key: str) -> bool:
        return cast(bool, self._call("hasParam", key))

    def deleteParam(self, key: str) -> int:
        return cast(int, self._call("deleteParam", key))

    def searchParam(self, key: str) -> str:
        return cast(str, self._call("searchParam", key))

    def getParamNames(self) -> Any:
        return self._call("getParamNames")

    def subscribeParam(self, caller_api: str, key: str) -> Any:
        return self._call("subscribeParam", caller_api, key)

    def unsubscribeParam(self, caller_api: str, key: str) -> int:
        return cast(int, self._call("unsubscribeParam", caller_api, key))


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
