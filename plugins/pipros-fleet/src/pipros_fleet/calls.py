"""Service calls and parameter access between members, in both directions."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from typing import Any, Final

from pipros.basics.budget import SharedBudget
from pipros.basics.errors import LimitExceeded, PiprosError, Refused
from pipros.basics.printable import printable
from pipros.net.shared_workers import SharedWorkers
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros.node.service_link import ErrorReply
from pipros.node.service_server import CallFailed, HandlerError, ServiceServer
from pipros_fleet import keys
from pipros_fleet.directory import FLEET_DIRECTORY_BYTES, DirectoryEntry, read_json
from pipros_fleet.fleet_rules import FleetFile
from pipros_fleet.parameter_rules import check_set, parameter_name, readable, top_of
from pipros_fleet.zenoh_session import SessionLink, ZenohQuestion
from pipros_libraries.topic_tools.raw import raw_service_class

FLEET_CALLS = 64
"""Maximum number of calls from other members that a member handles at a time; also of pending calls to one
service of another member. Each member, or each local node, can use at most half of what the others leave;
beyond it, its call fails at once.
"""

SUCCESS: Final = b"\x01"
FAILURE: Final = b"\x00"
GRACE_S: Final = 2.0
"""Time that a caller waits for the response beyond the service's own timeout."""
_LONGEST_REASON: Final = 2000


class RemoteService:
    """A service of another member, advertised on the local master."""

    def __init__(self, node: Node, link: SessionLink, me: str, member: str, entry: DirectoryEntry) -> None:
        """Advertise the service as `/<member><name>`. Blocks until the master responds.

        Raises:
            NameInUse: the node already has a service of this name.
        """
        self.entry = entry
        self.calls = self.failures = 0
        self._node = node
        self._link = link
        self._member = member
        self._key = keys.service(member, me, entry.name)
        self._is_closed = False
        self._class = raw_service_class(entry.type, entry.md5sum)
        self._slots = SharedBudget(FLEET_CALLS)
        self._server: ServiceServer = node.serve(f"/{member}{entry.name}", self._class, self._call)

    def close(self) -> None:
        """Unadvertise the service. Calls in progress fail."""
        self._is_closed = True
        self._node.endpoints.stop_serving(self._server)

    def _call(self, request: AnyMsg) -> AnyMsg:
        caller = request.header.get("callerid")
        if not self._slots.take(caller):
            raise HandlerError(
                f"too many calls of this node to [{self.entry.name}] of [{self._member}] are pending"
            )
        try:
            self.calls += 1
            return self._answer(request)
        except (HandlerError, CallFailed):
            self.failures += 1
            raise
        finally:
            self._slots.give_back(caller)

    def _answer(self, request: AnyMsg) -> AnyMsg:
        timeout_s = self.entry.timeout_s + GRACE_S
        try:
            answers = self._link.get(
                self._key,
                request.body,
                timeout_s=timeout_s,
                ended=lambda: self._is_closed or self._node.is_ending,
            )
        except PiprosError as error:
            raise HandlerError(str(error)) from None
        if not answers:
            raise HandlerError(
                f"[{self._member}] did not answer within {timeout_s:g} s, or the link was lost"
            )
        status, body = answers[0].payload[:1], answers[0].payload[1:]
        if status == SUCCESS:
            response: AnyMsg = self._class._response_class(body)
            return response
        if body:
            raise HandlerError(printable(body.decode("utf-8", "replace"), _LONGEST_REASON))
        raise CallFailed


class LocalCalls:
    """Handles other members' service calls and parameter requests. Thread-safe."""

    def __init__(self, node: Node, file: FleetFile, log: logging.Logger) -> None:
        self.calls = 0
        self.refused = 0
        self._node = node
        self._file = file
        self._log = log
        self._open = OpenCalls()
        self._workers = SharedWorkers("calls of other members", FLEET_CALLS, FLEET_CALLS)
        self.services: Mapping[str, DirectoryEntry] = {}

    def take(self, asked: ZenohQuestion) -> None:
        """Handle a request in a separate thread, or refuse it immediately if too many calls are running."""
        if not self._workers.run(asked.asker, self._run, asked):
            self.refused += 1
            asked.refuse("too many calls are running")
            asked.close()

    def close(self) -> None:
        """Interrupt all running calls."""
        self._open.interrupt()
        self._workers.close()

    def _run(self, asked: ZenohQuestion) -> None:
        try:
            self.calls += 1
            self._answer(asked)
        except PiprosError as error:
            self.refused += 1
            asked.refuse(str(error))
        finally:
            asked.close()

    def _answer(self, asked: ZenohQuestion) -> None:
        match keys.parts(asked.key):
            case (_, "s", [caller, *rest]) if rest:
                asked.answer(self._call(caller, keys.unmangled("/".join(rest)), asked.payload))
            case (_, "get" | "set", _) if len(asked.payload) > FLEET_DIRECTORY_BYTES:
                size = f"has {len(asked.payload)} bytes; the limit is {FLEET_DIRECTORY_BYTES} bytes"
                raise LimitExceeded(f"the request about a parameter {size}")
            case (_, "get", [caller]):
                asked.answer(_encoded(self._get(caller, read_json(asked.payload))))
            case (_, "set", [caller]):
                asked.answer(_encoded(self._set(caller, read_json(asked.payload))))

    def _call(self, caller: str, name: str, body: bytes) -> bytes:
        entry, rule = self.services.get(name), self._file.accepted_service(name)
        if entry is None or rule is None or not rule.accepts(caller):
            raise PiprosError(f"[{caller}] is not allowed to call [{printable(name, 200)}]")
        service = raw_service_class(entry.type, entry.md5sum)
        client = ServiceClient(
            name, service, master=lambda: self._node.master, calls=self._open, limits=self._node.limits
        )
        try:
            answer: AnyMsg = client.call(service._request_class(body), rule.timeout_s)
        except ErrorReply as error:
            return FAILURE + error.text.encode()
        except PiprosError as error:
            return FAILURE + str(error).encode()
        finally:
            client.close()
        return SUCCESS + answer.body

    def _get(self, caller: str, wanted: Any) -> Any:
        if wanted is None:  # a request for the names of all shared parameters
            names = self._node.master.get_param_names()
            return sorted(name for name in names if self._file.shares_parameter(name, caller))
        name = parameter_name(wanted)
        if not self._file.shares_parameter(name, caller):
            raise PiprosError(f"parameter [{printable(name, 200)}] is not shared with [{caller}]")
        try:
            return readable(self._file, caller, name, self._node.master.get_param(name))
        except Refused:
            raise PiprosError(f"parameter [{name}] is not set") from None

    def _set(self, caller: str, wanted: Any) -> Any:
        if not isinstance(wanted, list) or len(wanted) != 2:
            raise PiprosError(f"a request to set a parameter must be [name, value]; [{caller}] sent another")
        name, value = parameter_name(wanted[0]), wanted[1]
        if not self._file.sets_parameter(name, caller):
            raise PiprosError(f"[{caller}] is not allowed to set parameter [{printable(name, 200)}]")
        try:
            tree = self._node.master.get_param(top_of(name))
        except Refused:
            tree = None
        check_set(self._file, caller, name, value, tree)
        try:
            self._node.master.set_param(name, value)
        except (TypeError, ValueError, OverflowError) as error:
            raise PiprosError(f"cannot set [{printable(name, 200)}]: {error}") from None
        self._log.info("[%s] set the parameter [%s]", printable(caller), printable(name))
        return True


def _encoded(value: Any) -> bytes:
    try:
        return json.dumps(value, separators=(",", ":")).encode()
    except (TypeError, ValueError):
        raise PiprosError("the parameter's value cannot be sent as JSON") from None
