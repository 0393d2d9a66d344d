"""The services of the `rosapi` node, with which clients inspect the system and access parameters.

Names that the globs do not allow are omitted from responses. A request about such a name gets an empty
response; a request to read, set or delete such a parameter fails.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from pipros.basics.errors import PiprosError, Refused
from pipros.msg import load_message_class, load_service_class
from pipros.msg.language.full_text import specs_from_text
from pipros.msg.language.spec import BUILTINS, NUMBERS, FieldType, MessageSpec
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.clock import stamp
from pipros.node.service_link import split_service_uri
from pipros.node.service_server import HandlerError
from pipros_bridges.rosbridge.globs import Globs
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.params import ParameterNotSet, read, refused, visible
from pipros_tools.graph.services import nodes_by_service, services_of_type, type_of, uri_of
from pipros_tools.graph.system_state import SystemState, of_node

MASTER_DEADLINE_S: Final = 10.0
"""Timeout of each call to the master."""

_ACTION_TOPICS: Final = ("goal", "cancel", "status", "feedback", "result")


@dataclass(frozen=True, slots=True)
class Allowed:
    """Names that clients may see and use."""

    topics: Globs = field(default_factory=Globs)
    services: Globs = field(default_factory=Globs)
    params: Globs = field(default_factory=Globs)


class RosApi:
    """The service handlers. Each returns a dictionary with the fields of its response."""

    def __init__(self, node: Node, allowed: Allowed | None = None) -> None:
        self._node = node
        self._master = MasterClient(node.master.uri, node.name, timeout_s=MASTER_DEADLINE_S)
        self._allowed = allowed or Allowed()

    def serve(self, prefix: str = "~") -> None:
        """Advertise all services under `prefix`; by default as `~topics`, `~nodes` and so on."""
        for name, kind in SERVICES.items():
            service_class: Any = load_service_class(f"rosapi/{kind}")
            self._node.serve(f"{prefix}{name}", service_class, self._handler(name, service_class))

    def _handler(self, name: str, service_class: Any) -> Callable[[Any], Any]:
        answer = getattr(self, name)

        def handle(request: Any) -> Any:
            arguments = [getattr(request, slot) for slot in request.__slots__]
            try:
                return service_class._response_class(**answer(*arguments))
            except PiprosError as error:
                raise HandlerError(str(error)) from None

        return handle

    # -- topics -----------------------------------------------------------------------------

    def topics(self) -> dict[str, Any]:
        types = self._topic_types()
        return {"topics": list(types), "types": list(types.values())}

    def topics_for_type(self, kind: str) -> dict[str, Any]:
        return {"topics": [topic for topic, found in self._topic_types().items() if found == kind]}

    def topics_and_raw_types(self) -> dict[str, Any]:
        types = self._topic_types()
        texts = {kind: full_text(kind) for kind in set(types.values())}
        return {
            "topics": list(types),
            "types": list(types.values()),
            "typedefs_full_text": [texts[kind] for kind in types.values()],
        }

    def topic_type(self, topic: str) -> dict[str, Any]:
        return {"type": self._topic_types().get(topic, "")}

    def publishers(self, topic: str) -> dict[str, Any]:
        is_allowed = self._allowed.topics.allow(topic)
        return {"publishers": list(self._state().publishers.get(topic, ())) if is_allowed else []}

    def subscribers(self, topic: str) -> dict[str, Any]:
        is_allowed = self._allowed.topics.allow(topic)
        return {"subscribers": list(self._state().subscribers.get(topic, ())) if is_allowed else []}

    def action_servers(self) -> dict[str, Any]:
        topics = set(self._topic_types())
        names = (topic.removesuffix("/goal") for topic in topics if topic.endswith("/goal"))
        return {
            "action_servers": sorted(
                name for name in names if all(f"{name}/{part}" in topics for part in _ACTION_TOPICS)
            )
        }

    def _topic_types(self) -> Mapping[str, str]:
        """Return the type of each allowed topic, or an empty string if the type is unknown."""
        known = {topic: kind for topic, kind in self._master.get_topic_types() if kind != "*"}
        return {
            topic: known.get(topic, "")
            for topic in self._state().topics()
            if self._allowed.topics.allow(topic)
        }

    # -- services ---------------------------------------------------------------------------

    def services(self) -> dict[str, Any]:
        return {"services": self._allowed_services(nodes_by_service(self._master))}

    def services_for_type(self, kind: str) -> dict[str, Any]:
        return {"services": self._allowed_services(services_of_type(self._master, kind))}

    def service_type(self, service: str) -> dict[str, Any]:
        if not self._allowed.services.allow(service):
            return {"type": ""}
        try:
            return {"type": type_of(self._master, service) or ""}
        except GraphError:  # the node does not answer
            return {"type": ""}

    def service_providers(self, service: str) -> dict[str, Any]:
        """Return the nodes that offer this service. As in rosapi, `service` may also be a type."""
        nodes = nodes_by_service(self._master)
        names = [service] if service in nodes else services_of_type(self._master, service)
        return {"providers": sorted({nodes[name] for name in self._allowed_services(names) if name in nodes})}

    def service_node(self, service: str) -> dict[str, Any]:
        is_allowed = self._allowed.services.allow(service)
        return {"node": nodes_by_service(self._master).get(service, "") if is_allowed else ""}

    def service_host(self, service: str) -> dict[str, Any]:
        uri = uri_of(self._master, service) if self._allowed.services.allow(service) else None
        return {"host": split_service_uri(uri)[0] if uri else ""}

    def _allowed_services(self, names: Mapping[str, str] | Sequence[str]) -> list[str]:
        return [name for name in names if self._allowed.services.allow(name)]

    # -- nodes ------------------------------------------------------------------------------

    def nodes(self) -> dict[str, Any]:
        return {"nodes": self._state().nodes()}

    def node_details(self, node: str) -> dict[str, Any]:
        state, allow_topic = self._state(), self._allowed.topics.allow
        return {
            "subscribing": list(filter(allow_topic, of_node(node, state.subscribers))),
            "publishing": list(filter(allow_topic, of_node(node, state.publishers))),
            "services": self._allowed_services(of_node(node, state.services)),
        }

    def _state(self) -> SystemState:
        return SystemState.from_state(self._master.get_system_state())

    # -- types ------------------------------------------------------------------------------

    def message_details(self, kind: str) -> dict[str, Any]:
        if kind in BUILTINS:
            typedef: Any = load_message_class("rosapi/TypeDef")
            return {"typedefs": [typedef(**found) for found in described(kind, {}, set())]}
        return {"typedefs": typedefs(load_message_class(kind))}

    def service_request_details(self, kind: str) -> dict[str, Any]:
        service: Any = load_service_class(kind)
        return {"typedefs": typedefs(service._request_class)}

    def service_response_details(self, kind: str) -> dict[str, Any]:
        service: Any = load_service_class(kind)
        return {"typedefs": typedefs(service._response_class)}

    # -- parameters and time ----------------------------------------------------------------

    def set_param(self, name: str, value: str) -> dict[str, Any]:
        key = self._param(name)
        try:
            found = json.loads(value)
        except (ValueError, RecursionError) as error:
            hint = 'a text must be in quotation marks, such as "text"'
            raise HandlerError(f"cannot set {key}: value must be JSON: {error}; {hint}") from None
        if found is None:
            raise HandlerError(f"cannot set {key}: a parameter cannot be null; delete_param deletes it")
        try:
            self._check_change(key, found)
            self._master.set_param(key, found)
        except OverflowError as error:
            raise HandlerError(f"cannot set {key}: {error}; give it as a float or text") from None
        except (ValueError, TypeError, RecursionError) as error:
            raise HandlerError(f"cannot set {key}: {error}") from None
        return {}

    def get_param(self, name: str, default: str) -> dict[str, Any]:
        try:
            key = self._param(name)
            value = visible(key, read(self._master, key), self._allowed.params.allow)
        except ParameterNotSet:
            if not default:
                return {"value": "null"}
            try:
                value = json.loads(default)
            except (ValueError, RecursionError):
                value = default
        return {"value": json.dumps(value, default=str)}

    def has_param(self, name: str) -> dict[str, Any]:
        key = self._node.resolve(name)
        return {"exists": self._allowed.params.allow(key) and self._master.has_param(key)}

    def search_param(self, name: str) -> dict[str, Any]:
        try:
            found = str(self._master.search_param(name))
        except Refused:
            found = ""
        return {"global_name": found if self._allowed.params.allow(found) else ""}

    def delete_param(self, name: str) -> dict[str, Any]:
        key = self._param(name)
        self._check_change(key, None)
        if self._master.has_param(key):
            self._master.delete_param(key)
        return {}

    def get_param_names(self) -> dict[str, Any]:
        return {"names": list(filter(self._allowed.params.allow, self._master.get_param_names()))}

    def get_time(self) -> dict[str, Any]:

        return {"time": stamp(self._node.clock)}

    def _check_change(self, key: str, value: Any) -> None:
        """Refuse a change that affects a parameter which the globs do not allow."""
        allowed = self._allowed.params
        if allowed.patterns and (name := refused(key, value, self._master.get_param_names(), allowed.allow)):
            raise HandlerError(f"cannot change {key}: the globs do not allow the parameter {name}")

    def _param(self, name: str) -> str:
        key = self._node.resolve(name)
        if not self._allowed.params.allow(key):
            raise HandlerError(f"the globs do not allow the parameter {key}")
        return key


SERVICES: Final[Mapping[str, str]] = {
    "action_servers": "GetActionServers",
    "delete_param": "DeleteParam",
    "get_param": "GetParam",
    "get_param_names": "GetParamNames",
    "get_time": "GetTime",
    "has_param": "HasParam",
    "message_details": "MessageDetails",
    "node_details": "NodeDetails",
    "nodes": "Nodes",
    "publishers": "Publishers",
    "search_param": "SearchParam",
    "service_host": "ServiceHost",
    "service_node": "ServiceNode",
    "service_providers": "ServiceProviders",
    "service_request_details": "ServiceRequestDetails",
    "service_response_details": "ServiceResponseDetails",
    "service_type": "ServiceType",
    "services": "Services",
    "services_for_type": "ServicesForType",
    "set_param": "SetParam",
    "subscribers": "Subscribers",
    "topic_type": "TopicType",
    "topics": "Topics",
    "topics_and_raw_types": "TopicsAndRawTypes",
    "topics_for_type": "TopicsForType",
}
"""Service types, keyed by the names of their handlers."""

QUESTIONS: Final = frozenset(SERVICES) - {"set_param", "delete_param"}
"""The services that do not change the system."""


_NOT_AN_ARRAY: Final = -1
_ANY_LENGTH: Final = 0
_TIMES: Final = {"time": "uint32", "duration": "int32"}


def full_text(kind: str) -> str:
    try:
        return load_message_class(kind)._full_text if kind else ""
    except PiprosError:  # the type is not installed
        return ""


def typedefs(message_class: Any) -> list[Any]:
    """Return a TypeDef for a type and for each embedded type, outermost first."""
    typedef: Any = load_message_class("rosapi/TypeDef")
    specs = specs_from_text(message_class._type, message_class._full_text)
    return [typedef(**found) for found in described(message_class._type, specs, set())]


def described(kind: str, specs: Mapping[str, MessageSpec], seen: set[str]) -> Iterator[dict[str, Any]]:
    if kind in seen or (kind not in specs and kind not in _TIMES):
        return
    seen.add(kind)
    if kind in _TIMES:
        parts = [FieldType(_TIMES[kind])] * 2
        yield _typedef(kind, ["secs", "nsecs"], parts, MessageSpec(kind, (), (), "", ""))
        return
    spec = specs[kind]
    yield _typedef(kind, [field.name for field in spec.fields], [each.type for each in spec.fields], spec)
    for each in spec.fields:
        yield from described(each.type.base, specs, seen)


def _typedef(
    kind: str, names: Sequence[str], types: Sequence[FieldType], spec: MessageSpec
) -> dict[str, Any]:
    return {
        "type": kind,
        "fieldnames": list(names),
        "fieldtypes": [each.base for each in types],
        "fieldarraylen": [(each.length or _ANY_LENGTH) if each.is_array else _NOT_AN_ARRAY for each in types],
        "examples": [_example(each) for each in types],
        "constnames": [constant.name for constant in spec.constants],
        "constvalues": [str(constant.value) for constant in spec.constants],
    }


def _example(kind: FieldType) -> str:
    """Return the default value of a field as text."""
    if kind.is_array:
        return "[]"
    if kind.base == "bool":
        return "False"
    if kind.base in NUMBERS:
        return "0.0" if kind.base.startswith("float") else "0"
    return "" if kind.base == "string" else "{}"
