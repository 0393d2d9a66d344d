"""The interface of transform buffers, and the registries of types that can be transformed or converted."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import TYPE_CHECKING, Any, ClassVar

from std_msgs.msg import Header

import rospy
from pipros.basics.lazy_names import star_names as _star_names

if TYPE_CHECKING:
    from geometry_msgs.msg import TransformStamped

    from pipros.msg.time import Duration, Time

_star_names(__name__, "tf2=tf2_py tf2_ros")

_NO_TIME = rospy.Duration(0.0)


class BufferInterface:
    """Base class of buffers. It transforms objects of registered types; subclasses implement the lookups."""

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    def transform(
        self,
        object_stamped: Any,
        target_frame: str,
        timeout: Any = _NO_TIME,
        new_type: type[Any] | None = None,
    ) -> Any:
        """Transform an object to `target_frame` at its own timestamp, and convert it to `new_type` if given.

        Raises:
            TypeException: the type is not registered.
            tf2_ros.TransformException: the transform is not available within `timeout`.
        """
        do_transform = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout)
        moved = do_transform(object_stamped, found)
        return convert(moved, new_type) if new_type else moved

    def transform_full(
        self,
        object_stamped: Any,
        target_frame: str,
        target_time: Any,
        fixed_frame: str,
        timeout: Any = _NO_TIME,
        new_type: type[Any] | None = None,
    ) -> Any:
        """Transform an object to `target_frame` at `target_time`, and convert it to `new_type` if given.

        `fixed_frame` must not move between the object's timestamp and `target_time`.

        Raises:
            TypeException: the type is not registered.
            tf2_ros.TransformException: the transform is not available within `timeout`.
        """
        do_transform = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        moved = do_transform(object_stamped, found)
        return convert(moved, new_type) if new_type else moved

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration = _NO_TIME
    ) -> TransformStamped:
        """Return the transform from the source frame to the target frame."""
        raise NotImplementedException

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = _NO_TIME,
    ) -> TransformStamped:
        """Like `lookup_transform`, but with the source at `source_time` and the target at `target_time`."""
        raise NotImplementedException

    def can_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration = _NO_TIME
    ) -> Any:
        """Return whether `lookup_transform` would succeed."""
        raise NotImplementedException

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = _NO_TIME,
    ) -> Any:
        """Return whether `lookup_transform_full` would succeed."""
        raise NotImplementedException


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:
    """Set `obj.header` and return `obj`."""
    obj.header = Header(frame_id=frame_id, stamp=stamp)
    return obj


class TypeException(Exception):
    """A type is not registered. `errstr` is the error message."""

    def __init__(self, errstr: str) -> None:
        super().__init__(errstr)
        self.errstr = errstr


class NotImplementedException(Exception):
    """The buffer does not implement this lookup."""

    def __init__(self) -> None:
        self.errstr = "CanTransform or LookupTransform not implemented"
        super().__init__(self.errstr)


def _registered(functions: dict[Any, Any], key: Any) -> Any:
    try:
        return functions[key]
    except KeyError:
        raise TypeException(
            f"no transform or conversion is registered for {key}: import the module that provides it, "
            "such as tf2_geometry_msgs"
        ) from None


class TransformRegistration:
    """Registry of functions that transform objects, by type. All instances share the same entries."""

    _by_type: ClassVar[dict[Any, Callable[[Any, Any], Any]]] = {}

    def print_me(self) -> None:
        """Print the registry."""
        print(self._by_type)

    def add(self, key: Any, callback: Callable[[Any, Any], Any]) -> None:
        """Register `callback(object, TransformStamped)` for a type."""
        self._by_type[key] = callback

    def get(self, key: Any) -> Callable[[Any, Any], Any]:
        """Return the function for a type. Raises TypeException if the type is not registered."""
        function: Callable[[Any, Any], Any] = _registered(self._by_type, key)
        return function


class ConvertRegistration:
    """Registry of functions that convert objects, by type. All instances share the same entries."""

    _to_msg: ClassVar[dict[Any, Callable[[Any], Any]]] = {}
    _from_msg: ClassVar[dict[Any, Callable[[Any], Any]]] = {}
    _convert: ClassVar[dict[Any, Callable[[Any], Any]]] = {}

    def add_from_msg(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Register a function that converts a message to the type."""
        self._from_msg[key] = callback

    def add_to_msg(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Register a function that converts an object of the type to a message."""
        self._to_msg[key] = callback

    def add_convert(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Register a direct conversion for a pair of types (from, to)."""
        self._convert[key] = callback

    def get_from_msg(self, key: Any) -> Callable[[Any], Any]:
        """Return the conversion from a message. Raises TypeException if the type is not registered."""
        function: Callable[[Any], Any] = _registered(self._from_msg, key)
        return function

    def get_to_msg(self, key: Any) -> Callable[[Any], Any]:
        """Return the conversion to a message. Raises TypeException if the type is not registered."""
        function: Callable[[Any], Any] = _registered(self._to_msg, key)
        return function

    def get_convert(self, key: Any) -> Callable[[Any], Any]:
        """Return the direct conversion. Raises TypeException if the pair of types is not registered."""
        function: Callable[[Any], Any] = _registered(self._convert, key)
        return function


def convert(a: Any, b_type: type[Any]) -> Any:
    """Convert an object to `b_type`, by a direct conversion if one is registered, otherwise via a message.

    If `a` already has this type and no conversion is registered, return a deep copy.

    Raises:
        TypeException: a required conversion is not registered.
    """
    registration = ConvertRegistration()
    try:
        directly = registration.get_convert((type(a), b_type))
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
        return registration.get_from_msg(b_type)(registration.get_to_msg(type(a))(a))
    return directly(a)
