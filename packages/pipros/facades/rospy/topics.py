"""`rospy.Publisher` and `rospy.Subscriber`."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic, NoReturn, overload

import pipros.node as node_api
from pipros.basics.extras import required
from pipros.basics.lazy_names import lazy_names
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.names import is_legal
from pipros.msg.base import Message as Message
from pipros.msg.errors import SerializationError
from pipros.node import Node
from pipros.node.codec import AnyMessage
from pipros.node.context import NO_ARGS
from pipros.node.endpoints import TypeConflict
from rospy.core import *  # noqa: F403  # imported from here by other code
from rospy.exceptions import ROSException
from rospy.exceptions import ROSSerializationException as ROSSerializationException
from rospy.exceptions import TransportTerminated as TransportTerminated
from rospy.msg import args_kwds_to_message as args_kwds_to_message
from rospy.msg import refuse_ros2
from rospy.msg import serialize_message as serialize_message
from rospy.session import session

if TYPE_CHECKING:
    from pipros.msg.stub_types import FieldValue
    from rospy.topic_impl import PublisherImpl, SubscriberImpl, TopicImpl

DEFAULT_BUFF_SIZE = 65536
python3 = 1


class SubscribeListener:
    """Base class of listeners that are notified when subscribers connect or disconnect.

    Pass an instance of a subclass to `Publisher`.
    """

    def peer_subscribe(
        self,
        topic_name: str,
        topic_publish: Callable[..., None],
        peer_publish: Callable[..., None],
    ) -> None:
        """Handle a new subscriber.

        `topic_publish` sends to all subscribers, `peer_publish` only to the new subscriber.
        """

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Handle the loss of a subscriber. `num_peers` subscribers remain."""


class Topic(Generic[AnyMessage]):
    """Base class of `Publisher` and `Subscriber`.

    Attributes:
        name, resolved_name: the topic's global name.
        type: for example, `std_msgs/String`.
        md5sum: the MD5 sum of the type.
        data_class: the message class.
        reg_type: `pub` or `sub`.
    """

    def __init__(self, name: str, data_class: type[AnyMessage], reg_type: str) -> None:
        if not name or not isinstance(name, str):
            raise ValueError("topic name is not a non-empty string")
        if data_class is None:
            raise ValueError("topic parameter 'data_class' is not initialized")
        if not isinstance(data_class, type):
            raise ValueError(f"data_class [{data_class}] is not a class")
        if not issubclass(data_class, Message):
            refuse_ros2(data_class)  # type: ignore[unreachable]
            raise ValueError(f"data_class [{type(data_class).__name__}] is not a message data class")
        if not is_legal(name):
            warnings.warn(
                f"'{name}' is not a legal ROS graph resource name. "
                "This may cause problems with other ROS tools",
                stacklevel=3,
            )
        self.name = self.resolved_name = session.resolve_topic(name)
        self.type = data_class._type
        self.md5sum = data_class._md5sum
        self.data_class = data_class
        self.reg_type = reg_type

    @property
    def impl(self) -> TopicImpl | None:
        """The state shared by all handles of the topic in this process, or None if there are no handles."""
        return None

    def get_num_connections(self) -> int:
        """Return the number of connected peers."""
        return len(self.impl.connections) if self.impl is not None else 0

    def unregister(self) -> None:
        """Do nothing. Subclasses override this method to release the handle."""


class Publisher(Topic[AnyMessage]):
    """Publisher of messages of one type on a topic."""

    def __init__(
        self,
        name: str,
        data_class: type[AnyMessage],
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,
        latch: bool = False,
        headers: Mapping[str, str] | None = None,
        queue_size: int | None = None,
    ) -> None:
        """Register the topic, or defer this to `init_node` if the node has not started.

        Args:
            name: the topic.
            data_class: the message class.
            subscriber_listener: notified when subscribers connect or disconnect.
            tcp_nodelay: accepted for compatibility and ignored; subscribers request this (see `Subscriber`).
            latch: whether later subscribers receive the last message.
            headers: additional fields for the connection headers.
            queue_size: number of messages queued for a slow subscriber before the oldest is dropped; 0 for
                any number (up to 256 MiB), or None if `publish` should block.

        Raises:
            ValueError: `name` is empty (or private before `init_node`), `data_class` is not a message class,
                or this node already publishes the topic with another type.
        """
        super().__init__(name, data_class, "pub")
        if queue_size is None:
            warnings.warn(
                "The publisher should be created with an explicit keyword argument 'queue_size'. "
                "Please see http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers "
                "for more information.",
                SyntaxWarning,
                stacklevel=2,
            )
        del tcp_nodelay
        self._handle: node_api.Publisher[AnyMessage] | None = None
        self._impl: PublisherImpl | None = None
        self._is_unregistered = self._is_closed = False
        self._publish: Callable[[AnyMessage], None] = self._refuse
        queue_size = queue_size if queue_size is None or queue_size > 0 else 0

        def advertise(node: Node) -> None:
            if self._is_unregistered:
                return
            try:
                self._handle = node.endpoints.advertise(
                    self.resolved_name, data_class, queue_size=queue_size, latch=latch, headers=headers
                )
            except TypeConflict as error:
                raise ValueError(str(error)) from None
            self._publish = self._handle.publication.publish
            if subscriber_listener is not None:
                self._handle.publication.listeners.append(subscriber_listener)

        session.publishers.add(self)
        session.when_started(advertise)

    @overload
    def publish(self, message: AnyMessage, /) -> None: ...
    @overload
    def publish(self, value: FieldValue = ..., /) -> None: ...
    @overload
    def publish(self, first: Any, second: Any, /, *more: Any) -> None: ...
    @overload
    def publish(self, **fields: Any) -> None: ...
    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publish a message, given as an object or as field values: all positionally, or some by keyword.

        If `queue_size` is None, this method blocks for at most `pipros.Limits.stall_s` (2 s) in total for all
        subscribers; otherwise it does not wait for slow subscribers.

        If there are no subscribers, the message is not serialized, so invalid values are not detected. After
        the node has shut down, do nothing.

        Raises:
            ROSException: init_node has not been called, or the topic was unregistered.
            ROSSerializationException: a value does not fit the type of its field. Nothing was sent.
            TypeError, AttributeError: the arguments do not fit the type.
        """
        if len(args) == 1 and not kwds and type(args[0]) is self.data_class:
            message = args[0]
        else:
            message = args_kwds_to_message(self.data_class, args, kwds)
        try:
            self._publish(message)
        except SerializationError as error:
            raise ROSSerializationException(str(error)) from error

    def get_num_connections(self) -> int:
        """Return the number of connected subscribers."""
        handle = self._handle  # another thread may call unregister() in the meantime
        return handle.connection_count if handle is not None else 0

    def unregister(self) -> None:
        """Release this publisher.

        Releasing the last publisher unregisters the topic. May be called repeatedly.
        """
        self._is_unregistered = True
        self._publish = self._refuse
        handle, self._handle, self._impl = self._handle, None, None
        if handle is not None:
            handle.unregister()

    def close(self) -> None:
        """Make `publish` raise an exception from now on.

        Called when the publisher's node is no longer the process's node.
        """
        self._publish = self._refuse
        self._is_closed = True

    def _refuse(self, _: AnyMessage) -> NoReturn:
        if self._is_unregistered:
            raise ROSException("publish() to an unregistered() handle")
        if self._is_closed:
            raise ROSException("publish() to a closed topic")
        raise ROSException("ROS node has not been initialized yet. Please call init_node() first")

    @property
    def impl(self) -> PublisherImpl | None:
        """The state shared by all publishers of the topic in this process.

        None before init_node and after `unregister`.
        """
        if self._impl is None and self._handle is not None:
            from rospy.topic_impl import impls

            self._impl = impls.of_publication(self._handle.publication)
        return self._impl


class Subscriber(Topic[AnyMessage]):
    """Subscriber that calls a function with each message received on a topic."""

    @overload
    def __init__(
        self,
        name: str,
        data_class: type[AnyMessage],
        callback: Callable[[AnyMessage], object] | None = None,
        callback_args: None = None,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
        tcp_nodelay: bool = False,
        zero_copy: bool = False,
    ) -> None: ...
    @overload
    def __init__(
        self,
        name: str,
        data_class: type[AnyMessage],
        callback: Callable[[AnyMessage, Any], object],
        callback_args: Any,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
        tcp_nodelay: bool = False,
        zero_copy: bool = False,
    ) -> None: ...
    def __init__(
        self,
        name: str,
        data_class: type[AnyMessage],
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = DEFAULT_BUFF_SIZE,
        tcp_nodelay: bool = False,
        zero_copy: bool = False,
    ) -> None:
        """Register the topic, or defer this to `init_node` if the node has not started.

        Args:
            name: the topic.
            data_class: the message class, or `rospy.AnyMsg`.
            callback: called with each message, in the connection's thread. The callback may block.
            callback_args: passed to the callback as its second argument unless it is None.
            queue_size: number of most recent messages kept for a slow callback; None for all.
            buff_size: accepted for compatibility; messages of any size are received.
            tcp_nodelay: whether to ask publishers not to delay small messages.
            zero_copy: whether the callback receives `uint8[]` fields as read-only numpy arrays without a
                copy; with `numpy_msg`, also other arrays of numbers. (Not in Noetic.)

        Raises:
            ImportError: `zero_copy` is true, and numpy is not installed.
            ROSException: `queue_size` or `buff_size` is 0 or not an integer, or `buff_size` is negative.
            ValueError: `name` is empty (or private before `init_node`), `data_class` is not a message class,
                or this node already subscribes to the topic with another type.
        """
        super().__init__(name, data_class, "sub")
        for what, size in (("queue", -1 if queue_size is None else queue_size), ("buffer", buff_size)):
            if type(size) is not int:
                raise ROSException(f"{what} size must be an integer")
        if queue_size == 0:
            raise ROSException("queue size may not be set to zero")
        if buff_size <= 0:
            raise ROSException("buffer size must be a positive integer")
        if zero_copy:
            required("numpy", "zero_copy=True needs numpy", "numpy")  # also before `init_node`
        self.callback = callback
        self.callback_args = callback_args
        self._handle: node_api.Subscriber[AnyMessage] | None = None
        self._impl: SubscriberImpl | None = None
        self._is_unregistered = False

        def subscribe(node: Node) -> None:
            if self._is_unregistered:
                return
            try:
                self._handle = node.endpoints.subscribe(
                    self.resolved_name,
                    data_class,
                    callback,
                    callback_args=NO_ARGS if callback_args is None else callback_args,
                    queue_size=queue_size if queue_size is None or queue_size > 0 else None,
                    tcp_nodelay=tcp_nodelay,
                    zero_copy=zero_copy,
                )
            except TypeConflict as error:
                raise ValueError(str(error)) from None

        session.when_started(subscribe)

    def get_num_connections(self) -> int:
        """Return the number of connected publishers."""
        handle = self._handle  # another thread may call unregister() in the meantime
        return handle.connection_count if handle is not None else 0

    def unregister(self) -> None:
        """Remove the callback. Removing the last callback unregisters the topic. May be called repeatedly."""
        self._is_unregistered = True
        handle, self._handle, self._impl = self._handle, None, None
        if handle is not None:
            handle.unregister()

    @property
    def impl(self) -> SubscriberImpl | None:
        """The state shared by all subscribers of the topic in this process.

        None before init_node and after `unregister`.
        """
        if self._impl is None and self._handle is not None:
            from rospy.topic_impl import impls

            self._impl = impls.of_subscription(self._handle.subscription)
        return self._impl


if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "Poller": "rospy.impl.poller",
            "QueuedConnection": "rospy.impl.tcpros_pubsub",
            "Registration": "rospy.listeners",
            "SubscriberStatisticsLogger": "rospy.impl.statistics",
            "_PublisherImpl": "rospy.topic_impl:PublisherImpl",
            "_SubscriberImpl": "rospy.topic_impl:SubscriberImpl",
            "_TopicImpl": "rospy.topic_impl:TopicImpl",
            "_TopicManager": "rospy.managers:TopicManager",
            "get_registration_listeners": "rospy.impl.registration",
            "get_tcpros_handler": "rospy.impl.tcpros_pubsub",
            "get_topic_manager": "rospy.impl.registration",
            "set_topic_manager": "rospy.impl.registration",
        },
    )

_star_names(
    __name__,
    "atexit io:BytesIO itertools:chain genpy rospy.impl.registration:get_registration_listeners "
    "rospy.impl.tcpros:get_tcpros_handler rospy.impl.registration:get_topic_manager inspect "
    "rosgraph_msgs.msg:Log hashlib:md5 os functools:partial pickle "
    "rospy.impl.tcpros_pubsub:QueuedConnection rospy.impl.registration:Registration rosgraph rospkg rospy "
    "select rospy.impl.registration:set_topic_manager signal io:StringIO struct "
    "rospy.impl.statistics:SubscriberStatisticsLogger sys time traceback types urlparse=urllib.parse "
    "xmlrpcclient=xmlrpc.client",
)
