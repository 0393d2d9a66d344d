"""`rospy.Service`, `rospy.ServiceProxy` and `rospy.wait_for_service`."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from pipros.basics.lazy_names import lazy_names
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg import time as msg_time
from pipros.msg.base import Message
from pipros.node import Node
from pipros.node.endpoints import NameInUse
from pipros.node.service_server import HandlerError, ServiceClass, ServiceServer
from rospy.core import *  # noqa: F403  # imported from here by other code
from rospy.exceptions import ROSException, ROSInitException, ROSInterruptException
from rospy.msg import args_kwds_to_message, refuse_ros2
from rospy.rostime import in_seconds
from rospy.session import session
from rospy.topics import DEFAULT_BUFF_SIZE

if TYPE_CHECKING:
    from pipros.msg.stub_types import FieldValue
    from pipros.node.service_link import ServiceFailed

logger = logging.getLogger("rospy.service")

Request = TypeVar("Request", bound=Message)
Response = TypeVar("Response", bound=Message)
_Request_co = TypeVar("_Request_co", bound=Message, covariant=True)
_Response_co = TypeVar("_Response_co", bound=Message, covariant=True)
ErrorHandler = Callable[[BaseException, type[BaseException], BaseException, Any], object]


class ServiceException(Exception):
    """A service call failed, or a service cannot be registered."""


class CallInterrupted(ServiceException, ROSInterruptException):
    """The node was shut down during a call. Genuine rospy raises one of the two, depending on the moment."""


class TypedServiceClass(ServiceClass, Protocol[_Request_co, _Response_co]):
    """Service class, such as `std_srvs.srv.SetBool`, with its request and response classes."""

    @property
    def _request_class(self) -> type[_Request_co]: ...
    @property
    def _response_class(self) -> type[_Response_co]: ...


class ServiceProtocol:
    """The parts of a service connection that this module uses."""

    __slots__ = ("buff_size", "resolved_name", "service_class")

    def __init__(self, resolved_name: str, service_class: Any, buff_size: int) -> None:
        self.resolved_name = resolved_name
        self.service_class = service_class
        self.buff_size = buff_size


class Service:
    """A service that calls `handler(request)` for each call.

    Handlers run in threads, concurrently for different connections. They may return the response, its only
    field, its fields as a list, tuple or dictionary, or `[]` or `{}` for a response without fields.
    """

    def __init__(
        self,
        name: str,
        service_class: TypedServiceClass[Request, Response],
        handler: Callable[[Request], Response | FieldValue | Mapping[str, Any] | Message],
        buff_size: int = DEFAULT_BUFF_SIZE,
        error_handler: ErrorHandler | None = None,
    ) -> None:
        """Register the service, or defer this to `init_node` if the node has not started.

        `error_handler(exception, type, value, traceback)` is called if the handler raises an exception other
        than `ServiceException`; the client always receives an error. `buff_size` is accepted for
        compatibility and has no effect.

        Raises:
            ServiceException: this node already provides a service with this name.
            ValueError: the name is empty or not a string.
        """
        if not name or not isinstance(name, str):
            raise ValueError("service name is not a non-empty string")
        refuse_ros2(service_class)
        self.resolved_name = session.resolve(name)
        self.protocol = ServiceProtocol(self.resolved_name, service_class, buff_size)
        self.buff_size = buff_size
        self.error_handler = error_handler or _log_handler_error
        self.uri: str | None = None  # rosrpc://host:port, once the node is running
        self.service_class = service_class
        self.request_class = service_class._request_class
        self.response_class = service_class._response_class
        self.handler: Callable[[Any], Any] = handler
        self._node: Node | None = None
        self._server: ServiceServer | None = None

        self.registered = False
        self.seq = 0
        self._is_shut_down = False

        def serve(node: Node) -> None:
            if self._is_shut_down:
                return
            try:
                self._server = node.endpoints.serve(
                    self.resolved_name,
                    service_class,
                    self._respond,
                    _adapt(self.error_handler),
                )
            except NameInUse as error:
                raise ServiceException(str(error)) from None
            self._node = node
            self.uri = node.endpoints.service_uri
            self.registered = True
            session.services[self.resolved_name] = self

        try:
            if session.node is None:  # a running node checks names itself
                session.before.claim_service(self.resolved_name)
        except NameInUse as error:
            raise ServiceException(str(error)) from None
        session.when_started(serve)

    @property
    def done(self) -> bool:
        """Whether the service has been shut down."""
        return self._is_shut_down or session.is_shutdown

    def handle(self, transport: object, header: object) -> None:
        """Raise NotImplementedError, because pipros's node handles connections itself."""
        del transport, header
        raise NotImplementedError("Service.handle is not supported: pipros's node handles connections itself")

    def shutdown(self, reason: str = "") -> None:
        """Unregister the service. May be called repeatedly."""
        del reason
        self._is_shut_down = True
        session.before.release_service(self.resolved_name)
        if session.services.get(self.resolved_name) is self:
            del session.services[self.resolved_name]
        if self._node is not None and self._server is not None:
            self._node.endpoints.stop_serving(self._server)

    def spin(self) -> None:
        """Wait until the service or the node is shut down, or for KeyboardInterrupt.

        Raises:
            ROSInitException: init_node has not been called.
        """
        if session.node is None:
            raise ROSInitException("client code must call rospy.init_node() first")
        with contextlib.suppress(KeyboardInterrupt):
            while not (self._is_shut_down or session.node.wait_for_shutdown(0.5)):
                pass

    def _respond(self, request: Message) -> Message:
        try:
            response = self.handler(request)
        except ServiceException as error:
            raise HandlerError(str(error)) from error
        return convert_return_to_response(response, self.response_class)


def _log_handler_error(
    error: BaseException, kind: type[BaseException], value: BaseException, trace: Any
) -> None:
    """Log a handler's exception. This is the default `error_handler`."""
    del value, kind
    session.logger.error("Error processing request: %s", error, exc_info=(type(error), error, trace))


def _adapt(error_handler: ErrorHandler) -> Callable[[BaseException], object]:
    return lambda error: error_handler(error, type(error), error, error.__traceback__)


def convert_return_to_response(response: Any, response_class: type[Message]) -> Message:
    """Convert a handler's return value into the response.

    Raises:
        HandlerError: the value does not fit the response.
    """
    if isinstance(response, Message) and response._type == response_class._type:
        return response
    if response is None:
        raise HandlerError("service handler returned None")
    try:
        if isinstance(response, dict):
            return response_class(**response)
        if isinstance(response, (list, tuple)):
            return response_class(*response)
        return response_class(response)
    except (AttributeError, TypeError) as error:
        several = isinstance(response, (list, tuple))
        fault = "wrong number of values" if several else "invalid value"
        raise HandlerError(f"handler returned {fault}: {error}") from None


class ServiceProxy(Generic[Request, Response]):
    """A callable that calls a service with a request, or with the request's fields as arguments."""

    def __init__(
        self,
        name: str,
        service_class: TypedServiceClass[Request, Response],
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
        *,
        timeout: float | msg_time.Duration | None = None,
    ) -> None:
        """Store the settings, without connecting. A proxy can be created before `init_node`.

        Args:
            name: the service.
            service_class: the service class, for example `std_srvs.srv.Empty`.
            persistent: whether to keep one connection for all calls.
            headers: extra connection header fields, which the handler finds in `request._connection_header`.
            timeout: the timeout of a call in seconds; None for no limit. (Not in Noetic.)
        """
        refuse_ros2(service_class)
        self.resolved_name = session.resolve(name)
        self.service_class = service_class
        self.request_class: type[Request] = service_class._request_class
        self.response_class: type[Response] = service_class._response_class
        self.persistent = persistent
        self.buff_size = DEFAULT_BUFF_SIZE
        self.protocol = ServiceProtocol(self.resolved_name, service_class, self.buff_size)
        self.timeout = timeout
        self.seq = 0
        from pipros.node.service_client import ServiceClient  # imported here because many nodes call nothing

        self._client = ServiceClient(
            self.resolved_name,
            service_class,
            master=lambda: session.master,
            calls=session.calls,
            persistent=persistent,
            headers=headers,
        )

    def __call__(self, *args: Any, **kwds: Any) -> Response:
        """Same as `call`."""
        return self.call(*args, **kwds)

    def call(self, *args: Any, **kwds: Any) -> Response:
        """Call the service and return its response.

        The arguments are the request, all its fields in order, or some of its fields by name. The keyword
        `timeout` limits the duration of this call, unless the request has a field of that name.

        Raises:
            ServiceException: the service does not exist, it replied with an error, or the timeout expired.
            CallInterrupted: the node was shut down while waiting.
            TypeError, AttributeError: the arguments do not fit the request.
            genpy.SerializationError: a value does not fit the type of its field. Nothing was sent.
        """
        from pipros.node.service_link import ServiceFailed

        timeout = self.timeout
        if "timeout" in kwds and "timeout" not in self.request_class.__slots__:
            timeout = kwds.pop("timeout")
        request = args_kwds_to_message(self.request_class, args, kwds)
        self.seq += 1
        try:
            response: Response = self._client.call(request, None if timeout is None else in_seconds(timeout))
        except ServiceFailed as error:
            if session.is_shutdown:
                raise CallInterrupted("node shutdown interrupted service call") from None
            raise ServiceException(str(error)) from None
        return response

    def wait_for_service(self, timeout: float | msg_time.Duration | None = None) -> None:
        """Wait for the service; see `rospy.wait_for_service`."""
        wait_for_service(self.resolved_name, timeout=timeout)

    @property
    def uri(self) -> str | None:
        """The server's URI at the last call, `rosrpc://host:port`; None before the first call."""
        return self._client.uri

    @property
    def transport(self) -> object | None:
        """The connection of a persistent proxy; None before the first call and after `close`."""
        return self._client.kept

    def close(self) -> None:
        """Close the connection of a persistent proxy."""
        self._client.close()


def wait_for_service(service: str, timeout: float | msg_time.Duration | None = None) -> None:
    """Wait until a service is registered and its server responds.

    Raises:
        ValueError: `timeout` is 0.
        ROSException: the service was not available within `timeout` seconds, or the process runs pytest and
            the master does not respond.
        ROSInterruptException: the node was shut down while waiting.
    """
    from pipros.node.missing_master import NoMaster
    from pipros.node.service_client import ServiceClient

    client = ServiceClient(
        session.resolve(service), _AnyService, master=lambda: session.master, calls=session.calls
    )
    limit_s = None if timeout is None else in_seconds(timeout)
    if limit_s == 0:
        raise ValueError("timeout must be non-zero")

    def pause(seconds: float) -> None:
        if not session.is_shutdown:
            session.wait(seconds)
        if session.is_shutdown:
            raise ROSInterruptException("rospy shutdown")

    def report(error: ServiceFailed) -> None:
        if not session.is_shutdown:
            session.logger.warning("wait_for_service(%s): %s. Will keep trying.", client.service, error)

    pause(0)
    try:
        is_available = client.wait_until_available(limit_s, pause=pause, report=report)
    except NoMaster as error:
        raise ROSException(str(error)) from None
    if not is_available:
        raise ROSException(f"timeout exceeded while waiting for service {client.service}")


class _AnyService:
    """Placeholder for the service class, which is not needed to check that a server responds."""

    _type = _md5sum = "*"
    _request_class = _response_class = Message


if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "BIDIRECTIONAL": "rospy.impl.transport",
            "DeadTransport": "rospy.impl.transport",
            "INBOUND": "rospy.impl.transport",
            "OUTBOUND": "rospy.impl.transport",
            "ProtocolHandler": "rospy.impl.transport",
            "Registration": "rospy.listeners",
            "ServiceManager": "rospy.managers",
            "Transport": "rospy.impl.transport",
            "get_registration_listeners": "rospy.impl.registration",
            "set_service_manager": "rospy.impl.registration",
        },
    )

_star_names(
    __name__,
    "time atexit rospy.impl.transport:BIDIRECTIONAL rospy.impl.transport:DeadTransport "
    "rospy.impl.registration:get_registration_listeners rospy.impl.transport:INBOUND inspect "
    "rosgraph_msgs.msg:Log hashlib:md5 os rospy.impl.transport:OUTBOUND functools:partial pickle "
    "rospy.impl.transport:ProtocolHandler rospy.impl.registration:Registration rosgraph rospkg rospy "
    "rospy.impl.registration:set_service_manager signal struct sys traceback rospy.impl.transport:Transport "
    "types urlparse=urllib.parse xmlrpcclient=xmlrpc.client",
)
