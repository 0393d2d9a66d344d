"""The process that connects a gateway to ROS 2 through rclpy.

`RclpyEngine` runs this file with the Python of a ROS 2 installation, which has no pipros: it imports only the
standard library and rclpy. Both exchange frames over its standard input and output: a `HEADER` and a body.
The process ends if its standard input ends, or with the thread that started it.

ctypes adds what rclpy lacks: message types without generated code, and the publisher of a message.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import itertools
import json
import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from functools import lru_cache
from typing import Any, BinaryIO


class Kind(IntEnum):
    """The kinds of frames, with the contents of their bodies."""

    # To the agent.
    OPEN = 1  # JSON: the role, name and type of an endpoint, and for topics, its hash and QoS
    CLOSE = 2
    PUBLISH = 3  # the message
    CALL = 4  # the request
    # From the agent.
    GRAPH = 5  # JSON: the endpoints of other nodes
    SAMPLE = 6  # the publisher's GID, and the message
    REQUEST = 7  # the request
    FAILED = 8  # why the process ends, or with the number of a CALL, why that failed
    # In both directions, with the number of the frame that it answers.
    ANSWER = 9  # to OPEN, the error or nothing; to CALL, the response, or nothing without a server


HEADER = struct.Struct("<IBIQ")
"""Size of the body, kind, number of the endpoint, and number of a frame that is answered, or 0.

The answer 0 is the name of the middleware, when the agent has started.
"""
GID_BYTES = 16
"""Humble's GIDs have 8 more bytes, which are zero."""
GRAPH_S = 0.2
"""Least interval between queries of the graph, which take at most a tenth of the time."""
TAKEN = 100
"""Maximum number of messages that are taken from a subscription before the others get their turn."""
PENDING = 1000
"""Maximum number of calls or requests per endpoint that wait for a response; the oldest are forgotten."""
RAW_RMW = "rmw_fastrtps_cpp"
"""The middleware for which `raw_message_type` works."""
REPORTED = 100
END_S = 1.0
"""Maximum time by which closing the node delays the end of the process."""
_GID_AT = 40  # in rmw_message_info_t: after two times, two numbers, and a pointer
_TAKE_FAILED = 401
_PR_SET_PDEATHSIG = 1


def read_frame(file: BinaryIO) -> tuple[int, int, int, bytes] | None:
    """Return the kind, both numbers and the body of a frame, or None at the end of the file."""
    header = file.read(HEADER.size)
    if len(header) < HEADER.size:
        return None
    size, *numbers = HEADER.unpack(header)
    body = file.read(size)
    return (*numbers, body) if len(body) == size else None


class FrameWriter:
    """Writes frames to a file. Thread-safe."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._lock = threading.Lock()

    def send(self, kind: int, end: int, number: int, *parts: bytes) -> None:
        header = HEADER.pack(sum(map(len, parts)), kind, end, number)
        with self._lock:
            self._file.writelines((header, *parts))
            self._file.flush()


def _words(*values: int | None) -> Any:
    """Return a C structure of pointers and sizes."""
    return (ctypes.c_size_t * len(values))(*(each or 0 for each in values))


@lru_cache(None)
def raw_message_type(type_name: str, type_hash: str) -> Any:
    """Return a message class for serialized messages only, of a type that has no generated code.

    rmw_fastrtps_cpp asks for two type supports, and uses of them only what is not None here. The structures
    are those of rosidl's header files.
    """
    package, kind, name = type_name.split("/")
    pointer, address = ctypes.c_void_p, ctypes.addressof
    kept: list[Any] = []  # what the structures point to

    def text(value: str) -> int:
        kept.append(ctypes.create_string_buffer(value.encode()))
        return address(kept[-1])

    def function(call: Callable[..., Any], result: Any, *arguments: Any) -> int | None:
        kept.append(ctypes.CFUNCTYPE(result, *arguments)(call))
        return ctypes.cast(kept[-1], pointer).value

    def getter(value: Any) -> int | None:
        kept.append(value)
        return function(lambda _support: address(value), pointer, pointer)

    def max_size(bounds: int) -> int:
        ctypes.c_char.from_address(bounds).value = b"\0"  # unbounded
        return 0

    def choose(_support: int, identifier: bytes) -> int | None:
        return address(supports[identifier]) if identifier in supports else None

    size = function(max_size, ctypes.c_size_t, pointer)
    fast = _words(text(f"{package}::{kind}"), text(name), *3 * [None], size, None)
    introspected = _words(text(f"{package}__{kind}"), text(name), *6 * [None])
    digest = bytes.fromhex(type_hash.removeprefix("RIHS01_"))
    hashed = ctypes.create_string_buffer(bytes([len(digest) > 0]) + digest, 33)
    described = _words(text(type_name), len(type_name), len(type_name) + 1, *6 * [None])
    chooser = function(choose, pointer, pointer, ctypes.c_char_p)
    getters = getter(hashed), getter(described), getter(_words(*3 * [None]))
    supports = {
        identifier.encode(): _words(text(identifier), address(data), chooser, *getters)
        for identifier, data in (
            ("rosidl_typesupport_fastrtps_c", fast),
            ("rosidl_typesupport_introspection_c", introspected),
        )
    }
    capsule: Any = ctypes.pythonapi.PyCapsule_New
    capsule.restype, capsule.argtypes = ctypes.py_object, (pointer, ctypes.c_char_p, pointer)
    support = capsule(address(next(iter(supports.values()))), b"rosidl_message_type_support_t", None)
    converters = "_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE"
    kept += fast, introspected, supports
    members = {"_TYPE_SUPPORT": support, **dict.fromkeys(converters, True), "kept": kept}
    meta = type("RawType", (type,), {**members, "__import_type_support__": classmethod(lambda _: None)})
    return meta(name, (), {})


def generated_type(type_name: str) -> Any:
    """Return the generated class of a message, a service, or a part of an action such as `Dock_SendGoal`.

    Raises:
        ImportError, AttributeError: it is not installed.
    """
    package, kind, name = type_name.split("/")
    module = importlib.import_module(f"{package}.{kind}")
    if kind != "action":
        return getattr(module, name)
    action, _, part = name.rpartition("_")
    return getattr(getattr(module, action).Impl, part if part == "FeedbackMessage" else f"{part}Service")


class _Allocator(ctypes.Structure):
    _fields_ = (("words", ctypes.c_size_t * 5),)


class Taker:
    """Takes serialized messages with the GIDs of their publishers."""

    def __init__(self) -> None:
        self._rcl, self._rcutils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")
        self._rcutils.rcutils_get_default_allocator.restype = _Allocator
        self._message = _words(0, 0, 0, *self._rcutils.rcutils_get_default_allocator().words)
        self._info = (ctypes.c_uint8 * 256)()

    def take(self, handle: Any) -> tuple[bytes, bytes] | None:
        """Return the GID of the publisher and the message, or None if there is none."""
        code = self._rcl.rcl_take_serialized_message(
            ctypes.c_void_p(handle.pointer), self._message, self._info, None
        )
        if code:
            self._rcutils.rcutils_reset_error()
            if code != _TAKE_FAILED:
                raise RuntimeError(f"a message cannot be taken: error {code} of rcl")
            return None
        data, size = self._message[0], self._message[1]
        return bytes(self._info[_GID_AT : _GID_AT + GID_BYTES]), ctypes.string_at(data, size)


@dataclass
class RosEnd:
    """An endpoint of the gateway.

    Attributes:
        pending: the number of each call, by rclpy's number; or rclpy's header of each request, by number.
    """

    number: int
    role: str
    type: Any
    entity: Any
    pending: dict[int, Any] = field(default_factory=dict)

    def keep_pending(self, key: int, value: Any) -> None:
        self.pending[key] = value
        if len(self.pending) > PENDING:
            del self.pending[next(iter(self.pending))]


def error_of(function: Callable[..., object], *arguments: Any) -> str:
    """Call a function. Return its error, or "": what other nodes send must not end the process."""
    try:
        function(*arguments)
    except Exception as error:
        return " ".join(str(error).split()) or type(error).__name__
    return ""


class RclpyAgent:
    """A node of rclpy whose endpoints belong to the gateway.

    One thread obeys the gateway's frames. The main thread passes on what arrives, and observes the graph.
    """

    def __init__(self, domain: int, node: str, send: Callable[..., None]) -> None:
        self._send = send
        self._rclpy: Any = importlib.import_module("rclpy")
        self._coding: Any = importlib.import_module("rclpy.serialization")
        no_handlers = self._rclpy.signals.SignalHandlerOptions.NO
        self._rclpy.init(domain_id=domain, signal_handler_options=no_handlers)
        off = self._rclpy.parameter.Parameter("start_type_description_service", value=False)
        namespace, _, name = node.rpartition("/")
        self._node: Any = self._rclpy.create_node(
            name,
            namespace=namespace or "/",
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[off],
        )
        self._own = self._node.get_namespace(), self._node.get_name()
        self._wake = self._node.create_guard_condition(lambda: None)
        self._taker = Taker()
        self._lock = threading.Lock()  # of the endpoints, and of what is pending
        self._requests = itertools.count(1)
        self._ends: dict[int, RosEnd] = {}
        self._is_own: dict[bytes, bool] = {}  # of all known publishers and subscriptions
        self._graph = b""
        self._reported: set[str] = set()
        self._is_over = False
        self._rmw = str(self._rclpy.get_rmw_implementation_identifier())
        self._send(Kind.ANSWER, 0, 0, self._rmw.encode())

    def _try(self, function: Callable[..., object], *arguments: Any) -> None:
        """Call a function, and report each error once."""
        error = error_of(function, *arguments)
        if error and error not in self._reported and len(self._reported) < REPORTED:
            self._reported.add(error)
            print(f"pipros ros2: rclpy failed: {error}", file=sys.stderr, flush=True)

    # -- the thread that obeys frames

    def obey(self, file: BinaryIO) -> None:
        """Obey the frames of a file until it ends; then end the process."""
        uses: dict[int, Callable[..., None]] = {
            Kind.CLOSE: self._close,
            Kind.PUBLISH: self._publish,
            Kind.CALL: self._call,
            Kind.ANSWER: self._respond,
        }
        while (received := read_frame(file)) is not None:
            kind, end_number, number, body = received
            if kind == Kind.OPEN:
                error = error_of(self._open, end_number, json.loads(body))
                self._send(Kind.ANSWER, end_number, number, error.encode())
            elif (end := self._ends.get(end_number)) is not None:
                self._try(uses[kind], end, number, body)
        _end_with_parent(0)  # now the process ends by itself
        self._is_over = True
        self._wake.trigger()
        time.sleep(END_S)
        os._exit(0)

    def _open(self, number: int, spec: dict[str, Any]) -> None:
        """Create an endpoint. The role `type` creates nothing: it asks whether its type is installed."""
        type_name, type_hash = spec["type"], spec.get("hash")
        try:
            type_class = generated_type(type_name)
        except (ImportError, AttributeError):
            if type_hash is None or self._rmw != RAW_RMW:
                raise TypeError(f"the ROS 2 of {sys.executable} has no type {type_name}") from None
            type_class = raw_message_type(type_name, type_hash)
        if spec["role"] == "type":
            return
        end = RosEnd(number, spec["role"], type_class, self._create(type_class, spec))
        with self._lock:
            self._ends[number] = end
        self._wake.trigger()
        found = self._endpoints(end.role, spec["name"]) if type_hash else ()
        hashes = {each["hash"] for is_own, each in found if is_own and each["type"] == type_name}
        if hashes - {"", type_hash}:
            self._close(end)
            advice = "--distro must name its distribution"
            raise TypeError(f"rclpy has another definition of {type_name}; {advice}")

    def _create(self, type_class: Any, spec: dict[str, Any]) -> Any:
        qos, node, role, name = self._rclpy.qos, self._node, spec["role"], spec["name"]
        if role == "service":
            return node.create_service(type_class, name, lambda _, response: response)
        if role == "client":
            return node.create_client(type_class, name)
        profile = qos.QoSProfile(
            depth=spec["depth"],
            history=qos.HistoryPolicy.KEEP_LAST if spec["depth"] else qos.HistoryPolicy.KEEP_ALL,
            reliability=qos.ReliabilityPolicy[spec["reliability"].upper()],
            durability=qos.DurabilityPolicy[spec["durability"].upper()],
        )
        if role == "publisher":
            return node.create_publisher(type_class, name, profile)
        return node.create_subscription(type_class, name, lambda _: None, profile, raw=True)

    def _close(self, end: RosEnd, *_: object) -> None:
        with self._lock:
            del self._ends[end.number]
        getattr(self._node, f"destroy_{end.role}")(end.entity)
        self._wake.trigger()

    def _publish(self, end: RosEnd, _: int, message: bytes) -> None:
        end.entity.publish(message)

    def _call(self, end: RosEnd, number: int, body: bytes) -> None:
        if not end.entity.service_is_ready():
            self._send(Kind.ANSWER, end.number, number)
            return
        request = self._coding.deserialize_message(body, end.type.Request)
        with self._lock, end.entity.handle:
            end.keep_pending(end.entity.handle.send_request(request), number)

    def _respond(self, end: RosEnd, number: int, body: bytes) -> None:
        with self._lock:
            header = end.pending.pop(number, None)
        if header is not None:
            end.entity.send_response(self._coding.deserialize_message(body, end.type.Response), header)

    # -- the main thread

    def run(self) -> None:
        """Pass on messages, requests and responses until the other thread ends."""
        graph_at_s = 0.0
        while not self._is_over:
            started_s = time.monotonic()
            if started_s >= graph_at_s:
                self._try(self._send_graph)
                self._try(self._end_calls)
                now_s = time.monotonic()
                graph_at_s = now_s + max(GRAPH_S, 10 * (now_s - started_s))
            self._wait(graph_at_s - time.monotonic())
        self._node.destroy_node()
        self._rclpy.shutdown()

    def _wait(self, timeout_s: float) -> None:
        """Wait until an endpoint is ready, and take from all that are."""
        takes = {
            "subscription": self._take_samples,
            "client": self._take_response,
            "service": self._take_request,
        }
        context = self._node.context.handle
        with contextlib.ExitStack() as stack:
            with self._lock:  # what is entered can be closed, but remains valid
                ends = [end for end in self._ends.values() if end.role in takes]
                for handle in (context, self._wake.handle, *(end.entity.handle for end in ends)):
                    stack.enter_context(handle)
            make = self._rclpy.impl.implementation_singleton.rclpy_implementation.WaitSet
            subscriptions, clients, services = (sum(end.role == role for end in ends) for role in takes)
            wait_set = make(subscriptions, 1, 0, clients, services, 0, context)
            stack.enter_context(wait_set)
            wait_set.clear_entities()
            wait_set.add_guard_condition(self._wake.handle)
            for end in ends:
                getattr(wait_set, f"add_{end.role}")(end.entity.handle)
            wait_set.wait(max(0, int(timeout_s * 1e9)))
            ready = {pointer for role in takes for pointer in wait_set.get_ready_entities(role)}
            for end in ends:
                if end.entity.handle.pointer in ready:
                    self._try(takes[end.role], end)

    def _take_samples(self, end: RosEnd) -> None:
        for _ in range(TAKEN):
            taken = self._taker.take(end.entity.handle)
            if taken is None:
                return
            gid, payload = taken
            if gid not in self._is_own:  # the gateway must know a publisher before its first message
                self._try(self._send_graph)
            if not self._is_own.setdefault(gid, False):
                self._send(Kind.SAMPLE, end.number, 0, gid, payload)

    def _take_request(self, end: RosEnd) -> None:
        request, header = end.entity.handle.service_take_request(end.type.Request)
        if header is not None:
            number = next(self._requests)
            with self._lock:
                end.keep_pending(number, header)
            self._send(Kind.REQUEST, end.number, number, self._coding.serialize_message(request))

    def _take_response(self, end: RosEnd) -> None:
        header, response = end.entity.handle.take_response(end.type.Response)
        with self._lock:
            number = end.pending.pop(header.request_id.sequence_number, None) if header else None
        if number is not None:
            self._send(Kind.ANSWER, end.number, number, self._coding.serialize_message(response))

    def _end_calls(self) -> None:
        """End the calls whose server has ended, after the responses that have arrived."""
        with self._lock:
            clients = [end for end in self._ends.values() if end.role == "client" and end.pending]
            ended = [(end, [*end.pending]) for end in clients if not end.entity.service_is_ready()]
        for end, calls in ended:
            for _ in calls:
                self._take_response(end)
            for call in calls:
                if (number := end.pending.pop(call, None)) is not None:
                    self._send(Kind.FAILED, end.number, number, b"the server ended before it replied")

    def _endpoints(self, role: str, topic: str) -> Iterator[tuple[bool, dict[str, str]]]:
        """Yield whether an endpoint of a topic is of this node, and what the gateway must know about it."""
        infos: Any = ()
        with contextlib.suppress(Exception):  # other programs may use names that ROS 2 refuses
            infos = getattr(self._node, f"get_{role}s_info_by_topic")(topic)
        for info in infos:
            text = str(getattr(info, "topic_type_hash", ""))  # Humble announces none
            yield (
                (info.node_namespace, info.node_name) == self._own,
                {
                    "role": role,
                    "name": topic,
                    "type": info.topic_type,
                    "key": bytes(info.endpoint_gid[:GID_BYTES]).hex(),
                    "hash": text if text.startswith("RIHS01_") else "",
                    "reliability": info.qos_profile.reliability.name.lower(),
                    "durability": info.qos_profile.durability.name.lower(),
                    "node": _full_name(info.node_namespace, info.node_name),
                },
            )

    def _services(self, name: str, namespace: str) -> Iterator[dict[str, str]]:
        """Yield what the gateway must know about each service of a node."""
        node, services = _full_name(namespace, name), []
        with contextlib.suppress(Exception):  # the node has ended since
            services = self._node.get_service_names_and_types_by_node(name, namespace)
        for service, types in services:
            for each in types:
                key = f"{node} {service} {each}".encode().hex()
                yield {"role": "service", "name": service, "type": each, "key": key, "node": node}

    def _send_graph(self) -> None:
        """Send the endpoints of other nodes, if something has changed."""
        topics = [topic for topic, _ in self._node.get_topic_names_and_types()]
        pairs = itertools.product(("publisher", "subscription"), topics)
        found = [each for role, topic in pairs for each in self._endpoints(role, topic)]
        self._is_own = {bytes.fromhex(each["key"]): is_own for is_own, each in found}
        others = [each for is_own, each in found if not is_own]
        for name, namespace in sorted(set(self._node.get_node_names_and_namespaces())):
            if (namespace, name) != self._own:
                others += self._services(name, namespace)
        graph = json.dumps(others).encode()
        if graph != self._graph:
            self._graph = graph
            self._send(Kind.GRAPH, 0, 0, graph)


def _full_name(namespace: str, name: str) -> str:
    return "" if "_NODE_NAME_UNKNOWN_" in name else f"{namespace.rstrip('/')}/{name}"


def _end_with_parent(number: int) -> None:
    """Let Linux send a signal to this process when the thread that started it ends; 0 for none."""
    with contextlib.suppress(AttributeError, TypeError):  # of other systems
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number, 0, 0, 0)


def main() -> None:
    _end_with_parent(getattr(signal, "SIGKILL", 0))  # Windows lacks it
    out = FrameWriter(os.fdopen(os.dup(1), "wb"))
    os.dup2(2, 1)  # what others print must not disturb the frames
    try:
        agent = RclpyAgent(int(sys.argv[1]), sys.argv[2], out.send)
        threading.Thread(target=agent.obey, args=(sys.stdin.buffer,), daemon=True).start()
        agent.run()
    except Exception as error:
        out.send(Kind.FAILED, 0, 0, f"{type(error).__name__}: {error}".encode())
    os._exit(0)


if __name__ == "__main__":
    main()
