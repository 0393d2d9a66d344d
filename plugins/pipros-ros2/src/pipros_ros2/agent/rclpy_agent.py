"""The process that connects a gateway to ROS 2 through rclpy.

`RclpyEngine` runs this file with the Python of a ROS 2 installation, which has no pipros: it imports only the
standard library and rclpy. Both exchange frames over its standard input and output: a `HEADER` and a body.
The process ends if its standard input ends, or with the thread that started it.

ctypes adds what rclpy lacks: message types without generated code, and the publisher of a message.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib
import itertools
import json
import os
import signal
import struct
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable
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
    CALL = 4  # the number of the call, and the request
    FORGET = 5  # the number of a call whose reply is no longer needed
    ANSWER = 6  # the number of the request, and the response; no response if the service failed
    # From the agent.
    DONE = 7  # the error of an OPEN frame, or nothing; for endpoint 0, JSON about the start
    GRAPH = 8  # JSON: see `Agent._send_graph`
    SAMPLE = 9  # the publisher's GID, and the message
    REPLY = 10  # the number of the call, and the response
    REQUEST = 11  # the number of the request, and the request


HEADER = struct.Struct("<IBI")
"""Size of the body, kind, and number of the endpoint."""
NUMBER = struct.Struct("<Q")
GID_BYTES = 16
"""Humble's GIDs have 8 more bytes, which are zero."""
GRAPH_S = 0.2
"""Least interval between queries of the graph, which take at most a tenth of the time."""
SERVER_S = 0.05
"""Interval between checks whether a server has become available for a waiting call."""
TAKEN = 100
"""Maximum number of messages that are taken from a subscription before the others get their turn."""
RAW_RMW = "rmw_fastrtps_cpp"
"""The middleware for which `raw_message_type` works."""
REPORTED = 100
END_S = 1.0
"""Maximum time by which closing the node delays the end of the process."""
_GID_AT = 40  # in rmw_message_info_t: after two times, two numbers, and a pointer
_TAKE_FAILED = 401
_PR_SET_PDEATHSIG = 1


def read_frame(file: BinaryIO) -> tuple[int, int, bytes] | None:
    """Return the kind, the number of the endpoint and the body of a frame, or None at the end of the file."""
    header = file.read(HEADER.size)
    if len(header) < HEADER.size:
        return None
    size, kind, number = HEADER.unpack(header)
    body = file.read(size)
    return (kind, number, body) if len(body) == size else None


def _words(*values: int | None) -> Any:
    """Return a C structure of pointers and sizes."""
    return (ctypes.c_size_t * len(values))(*(each or 0 for each in values))


@lru_cache(None)
def raw_message_type(type_name: str, type_hash: str) -> Any:
    """Return a message class for serialized messages only, of a type that has no generated code.

    rmw_fastrtps_cpp asks for two type supports, and uses little of them for serialized messages. The
    structures are those of rosidl's header files.
    """
    package, kind, name = type_name.split("/")
    pointer, address = ctypes.c_void_p, ctypes.addressof
    kept: list[Any] = []

    def text(value: str) -> int:
        kept.append(ctypes.create_string_buffer(value.encode()))
        return address(kept[-1])

    def function(result: Any, *arguments: Any) -> Callable[[Callable[..., Any]], int | None]:
        def make(each: Callable[..., Any]) -> int | None:
            kept.append(ctypes.CFUNCTYPE(result, *arguments)(each))
            return ctypes.cast(kept[-1], pointer).value

        return make

    def returning(each: Any) -> int | None:
        kept.append(each)
        return function(pointer, pointer)(lambda _support: address(each))

    def max_size(bounds: int) -> int:
        ctypes.c_char.from_address(bounds).value = b"\0"  # unbounded
        return 0

    def choose(_support: int, identifier: bytes) -> int | None:
        return address(supports[identifier]) if identifier in supports else None

    code = function(ctypes.c_bool, pointer, pointer)(lambda _message, _stream: False)
    size = function(ctypes.c_uint32, pointer)(lambda _message: 0)
    largest = function(ctypes.c_size_t, pointer)(max_size)
    data = {
        "rosidl_typesupport_fastrtps_c": _words(
            *(text(f"{package}::{kind}"), text(name), code, code, size, largest, None)
        ),
        "rosidl_typesupport_introspection_c": _words(text(f"{package}__{kind}"), text(name), *6 * [None]),
    }
    digest = bytes.fromhex(type_hash.removeprefix("RIHS01_"))
    hashed = ctypes.create_string_buffer(bytes([len(digest) > 0]) + digest, 33)
    size_of_name = len(type_name)
    described = _words(text(type_name), size_of_name, size_of_name + 1, *6 * [None])
    chooser = function(pointer, pointer, ctypes.c_char_p)(choose)
    getters = returning(hashed), returning(described), returning(_words(*3 * [None]))
    supports = {
        identifier.encode(): _words(text(identifier), address(each), chooser, *getters)
        for identifier, each in data.items()
    }
    capsule: Any = ctypes.pythonapi.PyCapsule_New
    capsule.restype, capsule.argtypes = ctypes.py_object, (pointer, ctypes.c_char_p, pointer)
    support = capsule(address(next(iter(supports.values()))), b"rosidl_message_type_support_t", None)
    converters = "_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE"
    members = {"_TYPE_SUPPORT": support, **dict.fromkeys(converters, True), "kept": (kept, data, supports)}
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
        waiting: the calls until a server is available.
    """

    number: int
    spec: dict[str, Any]
    entity: Any
    type: Any
    pending: dict[int, Any] = field(default_factory=dict)
    waiting: deque[tuple[int, bytes]] = field(default_factory=deque)


class RclpyAgent:
    """A node of rclpy whose endpoints belong to the gateway.

    One thread reads frames; it publishes, calls and answers. The main thread does everything else.
    """

    def __init__(self, settings: dict[str, Any], out: BinaryIO) -> None:
        self._out = out
        self._out_lock = threading.Lock()
        self._rclpy: Any = importlib.import_module("rclpy")
        self._coding: Any = importlib.import_module("rclpy.serialization")
        self._rclpy.init(
            domain_id=settings["domain"], signal_handler_options=self._rclpy.signals.SignalHandlerOptions.NO
        )
        off = self._rclpy.parameter.Parameter("start_type_description_service", value=False)
        self._node: Any = self._rclpy.create_node(
            settings["node"].rpartition("/")[2],
            namespace=settings["node"].rpartition("/")[0] or "/",
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[off],
        )
        self._own = self._node.get_namespace(), self._node.get_name()
        self._wake = self._node.create_guard_condition(lambda: None)
        self._taker = Taker()
        self._lock = threading.Lock()
        self._requests = itertools.count(1)
        self._ends: dict[int, RosEnd] = {}
        self._commands: deque[tuple[int, int, bytes]] = deque()
        self._is_own: dict[bytes, bool] = {}  # of all known publishers and subscriptions
        self._graph = b""
        self._reported: set[str] = set()
        self._is_over = False
        self.rmw = str(self._rclpy.get_rmw_implementation_identifier())

    def send(self, kind: Kind, number: int, *parts: bytes) -> None:
        with self._out_lock:
            self._out.write(HEADER.pack(sum(map(len, parts)), kind, number))
            self._out.writelines(parts)
            self._out.flush()

    # -- the thread that reads frames

    def read(self, file: BinaryIO) -> None:
        """Obey the frames of a file until it ends; then end the process."""
        while (frame := read_frame(file)) is not None:
            kind, number, body = frame
            if kind in (Kind.OPEN, Kind.CLOSE):
                self._commands.append(frame)
                self._wake.trigger()
            elif (end := self._ends.get(number)) is not None:
                self._try(self._use, end, kind, body)
        _end_with_parent(0)  # now the process ends by itself
        self._is_over = True
        self._wake.trigger()
        time.sleep(END_S)
        os._exit(0)

    def _try(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function. Report each error once: what other nodes send must not end the process."""
        try:
            function(*arguments)
        except Exception as error:
            text = f"pipros ros2: rclpy failed: {' '.join(str(error).split())}"
            if text not in self._reported and len(self._reported) < REPORTED:
                self._reported.add(text)
                print(text, file=sys.stderr, flush=True)

    def _use(self, end: RosEnd, kind: int, body: bytes) -> None:
        if kind == Kind.PUBLISH:
            end.entity.publish(body)
            return
        (number,), payload = NUMBER.unpack_from(body), body[NUMBER.size :]
        with self._lock:
            if kind == Kind.CALL:
                end.waiting.append((number, payload))
                self._call_waiting(end)
                if end.waiting:
                    self._wake.trigger()
            elif kind == Kind.FORGET:
                end.waiting = deque(each for each in end.waiting if each[0] != number)
                end.pending = {key: value for key, value in end.pending.items() if value != number}
            elif (header := end.pending.pop(number, None)) is not None and payload:
                end.entity.send_response(self._decoded(payload, end.type.Response), header)

    def _decoded(self, payload: bytes, type_class: Any) -> Any:
        return self._coding.deserialize_message(payload, type_class)

    def _call_waiting(self, end: RosEnd) -> None:
        """Send the waiting calls of a client if a server is available. The caller holds the lock."""
        while end.waiting and end.entity.service_is_ready():
            number, payload = end.waiting.popleft()
            request = self._decoded(payload, end.type.Request)
            with end.entity.handle:
                end.pending[end.entity.handle.send_request(request)] = number

    # -- the main thread

    def run(self) -> None:
        """Pass on messages, requests and replies until the standard input ends."""
        graph_at_s = 0.0
        while not self._is_over:
            while self._commands:
                kind, number, body = self._commands.popleft()
                if kind == Kind.CLOSE:
                    self._close(number)
                else:
                    self.send(Kind.DONE, number, self._open(number, json.loads(body)).encode())
            started_s = time.monotonic()
            if started_s >= graph_at_s:
                self._try(self._send_graph)
                now_s = time.monotonic()
                graph_at_s = now_s + max(GRAPH_S, 10 * (now_s - started_s))
            waiting = [end for end in self._ends.values() if end.waiting]
            with self._lock:
                for end in waiting:
                    self._call_waiting(end)
            self._wait(SERVER_S if waiting else graph_at_s - time.monotonic())
        self._node.destroy_node()
        self._rclpy.shutdown()

    def _wait(self, timeout_s: float) -> None:
        """Wait until an endpoint is ready, and take from all that are."""
        takes = {
            "subscription": self._take_samples,
            "client": self._take_reply,
            "service": self._take_request,
        }
        ends = [end for end in self._ends.values() if end.spec["role"] in takes]
        subscriptions, clients, services = (sum(end.spec["role"] == role for end in ends) for role in takes)
        context = self._node.context.handle
        with contextlib.ExitStack() as stack:
            for handle in (context, self._wake.handle, *(end.entity.handle for end in ends)):
                stack.enter_context(handle)
            make = self._rclpy.impl.implementation_singleton.rclpy_implementation.WaitSet
            wait_set = make(subscriptions, 1, 0, clients, services, 0, context)
            stack.enter_context(wait_set)
            wait_set.clear_entities()
            wait_set.add_guard_condition(self._wake.handle)
            for end in ends:
                getattr(wait_set, f"add_{end.spec['role']}")(end.entity.handle)
            wait_set.wait(max(0, int(timeout_s * 1e9)))
            ready = {pointer for role in takes for pointer in wait_set.get_ready_entities(role)}
            for end in ends:
                if end.entity.handle.pointer in ready:
                    self._try(takes[end.spec["role"]], end)

    def _take_samples(self, end: RosEnd) -> None:
        for _ in range(TAKEN):
            taken = self._taker.take(end.entity.handle)
            if taken is None:
                return
            gid, payload = taken
            if gid not in self._is_own:  # the gateway must know a publisher before its first message
                self._try(self._send_graph)
            if not self._is_own.setdefault(gid, False):
                self.send(Kind.SAMPLE, end.number, gid, payload)

    def _take_request(self, end: RosEnd) -> None:
        request, header = end.entity.handle.service_take_request(end.type.Request)
        if header is not None:
            number = next(self._requests)
            with self._lock:
                end.pending[number] = header
            self._send_part(Kind.REQUEST, end, number, request)

    def _take_reply(self, end: RosEnd) -> None:
        header, response = end.entity.handle.take_response(end.type.Response)
        if header is not None:
            with self._lock:
                number = end.pending.pop(header.request_id.sequence_number, None)
            if number is not None:
                self._send_part(Kind.REPLY, end, number, response)

    def _send_part(self, kind: Kind, end: RosEnd, number: int, part: Any) -> None:
        payload = self._coding.serialize_message(part)
        self.send(kind, end.number, NUMBER.pack(number), payload)

    def _open(self, number: int, spec: dict[str, Any]) -> str:
        """Create an endpoint, and return an error, or "".

        The role `type` creates nothing: it asks whether services of the type are possible.
        """
        role, name, type_name = spec["role"], spec["name"], spec["type"]
        is_topic = role in ("publisher", "subscription")
        try:
            type_class = generated_type(type_name)
        except (ImportError, AttributeError):
            if not is_topic or self.rmw != RAW_RMW:
                return f"the ROS 2 of {sys.executable} has no type {type_name}"
            type_class = raw_message_type(type_name, spec["hash"])
        try:
            if is_topic:
                entity, has_other_hash = self._open_topic(type_class, spec)
            elif role == "service":
                entity = self._node.create_service(type_class, name, lambda _, response: response)
            elif role == "client":
                entity = self._node.create_client(type_class, name)
            else:
                return ""
        except Exception as error:
            return str(error) or type(error).__name__
        self._ends[number] = RosEnd(number, spec, entity, type_class)
        if is_topic and has_other_hash:
            self._close(number)
            return f"rclpy has another definition of {type_name}; --distro must name its distribution"
        return ""

    def _open_topic(self, type_class: Any, spec: dict[str, Any]) -> tuple[Any, bool]:
        """Return a publisher or subscription, and whether rclpy announces another hash than the gateway's."""
        qos, node, name = self._rclpy.qos, self._node, spec["name"]
        profile = qos.QoSProfile(
            depth=spec["depth"],
            history=qos.HistoryPolicy.KEEP_LAST if spec["depth"] else qos.HistoryPolicy.KEEP_ALL,
            reliability=qos.ReliabilityPolicy[spec["reliability"].upper()],
            durability=qos.DurabilityPolicy[spec["durability"].upper()],
        )
        if spec["role"] == "publisher":
            entity = node.create_publisher(type_class, name, profile)
        else:
            entity = node.create_subscription(type_class, name, lambda _: None, profile, raw=True)
        found = (self._endpoint(spec["role"], name, each) for each in self._infos(spec["role"], name))
        hashes = {each["hash"] for is_own, each in found if is_own and each["type"] == spec["type"]}
        return entity, bool(spec["hash"] and hashes - {"", spec["hash"]})

    def _close(self, number: int) -> None:
        if (end := self._ends.pop(number, None)) is not None:
            getattr(self._node, f"destroy_{end.spec['role']}")(end.entity)

    def _infos(self, role: str, topic: str) -> Any:
        return getattr(self._node, f"get_{role}s_info_by_topic")(topic)

    def _endpoint(self, role: str, topic: str, info: Any) -> tuple[bool, dict[str, str]]:
        """Return whether this node has an endpoint, and what the gateway must know about it."""
        text = str(getattr(info, "topic_type_hash", ""))  # Humble announces none
        return (info.node_namespace, info.node_name) == self._own, {
            "role": role,
            "name": topic,
            "type": info.topic_type,
            "key": bytes(info.endpoint_gid[:GID_BYTES]).hex(),
            "hash": text if text.startswith("RIHS01_") else "",
            "reliability": info.qos_profile.reliability.name.lower(),
            "durability": info.qos_profile.durability.name.lower(),
            "node": _full_name(info.node_namespace, info.node_name),
        }

    def _send_graph(self) -> None:
        """Send the endpoints of other nodes, if something has changed."""
        node, others = self._node, []
        self._is_own = {}
        for topic, _ in node.get_topic_names_and_types():
            for role in ("publisher", "subscription"):
                infos: Any = ()
                with contextlib.suppress(Exception):  # other programs may use names that ROS 2 refuses
                    infos = self._infos(role, topic)
                for info in infos:
                    is_own, found = self._endpoint(role, topic, info)
                    self._is_own[bytes.fromhex(found["key"])] = is_own
                    others += [] if is_own else [found]
        for name, namespace in sorted(set(node.get_node_names_and_namespaces()) - {self._own[::-1]}):
            full_name, services = _full_name(namespace, name), []
            with contextlib.suppress(Exception):  # the node has ended since
                services = node.get_service_names_and_types_by_node(name, namespace)
            for service, types in services:
                for type_name in types:
                    key = hashlib.sha256(f"{full_name} {service} {type_name}".encode()).hexdigest()
                    found = {"role": "service", "name": service, "type": type_name, "node": full_name}
                    others.append({"key": key[: 2 * GID_BYTES], **found})
        graph = json.dumps(others).encode()
        if graph != self._graph:
            self._graph = graph
            self.send(Kind.GRAPH, 0, graph)


def _full_name(namespace: str, name: str) -> str:
    return "" if "_NODE_NAME_UNKNOWN_" in name else f"{namespace.rstrip('/')}/{name}"


def _end_with_parent(number: int) -> None:
    """Let Linux send a signal to this process when the thread that started it ends; 0 for none."""
    with contextlib.suppress(AttributeError, TypeError):  # of other systems
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number, 0, 0, 0)


def main() -> None:
    _end_with_parent(getattr(signal, "SIGKILL", 0))  # Windows lacks it
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what others print must not disturb the frames
    try:
        agent = RclpyAgent(json.loads(sys.argv[1]), out)
        start: dict[str, Any] = {"rmw": agent.rmw, "pid": os.getpid()}
    except Exception as error:
        start = {"error": f"{type(error).__name__}: {error}"}
    text = json.dumps(start).encode()
    out.write(HEADER.pack(len(text), Kind.DONE, 0) + text)
    out.flush()
    if "error" not in start:
        threading.Thread(target=agent.read, args=(sys.stdin.buffer,), daemon=True).start()
        try:
            agent.run()
        except Exception:
            traceback.print_exc()
            os._exit(1)
    os._exit(0)


if __name__ == "__main__":
    main()
