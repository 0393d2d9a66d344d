"""Calls services for clients, as far as the policy allows."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.names import canonicalize, is_global
from pipros.basics.printable import printable
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros_bridges.rosapi import MASTER_DEADLINE_S
from pipros_bridges.rosbridge.effects import CallService
from pipros_bridges.rosbridge.encoding import Encoder
from pipros_bridges.rosbridge.filling import Filler
from pipros_bridges.rosbridge.protocol import QUESTION_NAMES
from pipros_server.act_gate import ActGate
from pipros_tools.graph.services import service_class_of

SET_PARAM: Final = "/rosapi/set_param"
SET_PARAM_TYPE: Final = "rosapi/SetParam"
"""The service that sets parameters. If there is a policy, each call needs a rule for the parameter."""


class RosbridgeCaller:
    """Performs the calls of all clients. Methods may be called from any thread."""

    def __init__(self, node: Node, gate: ActGate, filler: Filler, encoder: Encoder, call_s: float) -> None:
        """Store the arguments. `call_s` is the maximum duration (s) of a call."""
        self._node = node
        self._gate = gate
        self._filler = filler
        self._encoder = encoder
        self._call_s = call_s
        self._master = MasterClient(node.master.uri, node.name, timeout_s=MASTER_DEADLINE_S)

    def call(self, effect: CallService, calls: OpenCalls) -> Any:
        """Return the values of the service's response. Blocks; `calls` can interrupt it.

        Raises:
            PiprosError: the call is not allowed, or it fails.
        """
        service = self._node.resolve(effect.service)
        service_class = service_class_of(self._master, service, calls)
        request: Any = service_class._request_class()
        self._filler.fill(request, effect.arguments)
        client = ServiceClient(
            service, service_class, master=lambda: self._master, calls=calls, limits=self._node.limits
        )
        with self._calling(service, service_class, request):
            return self._encoder.values_of(client.call(request, self._call_s))

    def close(self) -> None:
        """Close the connection to the master."""
        self._master.close()

    def _calling(self, service: str, service_class: Any, request: Any) -> AbstractContextManager[None]:
        """Return the context manager for a call. Raise `ActRefused` if the policy does not allow it."""
        gate = self._gate
        if gate.policy is None or service in QUESTION_NAMES:
            return nullcontext()
        if service == SET_PARAM and service_class._type == SET_PARAM_TYPE:
            if not is_global(request.name):  # rosapi would resolve it to a name that was not checked
                raise PiprosError(f"with a policy, name must be a global name, got {printable(request.name)}")
            try:
                value = json.loads(request.value)
            except (ValueError, RecursionError) as error:
                raise PiprosError(f"value is not JSON: {error}") from None
            gate.check_parameter(canonicalize(request.name), value)
            return nullcontext()
        return gate.calling(service, request, service_class._type, service_class._md5sum)
