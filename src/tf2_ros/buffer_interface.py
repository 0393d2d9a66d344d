"""What every buffer offers, and the types that can be transformed and converted."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any, ClassVar

from std_msgs.msg import Header

import rospy
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "tf2=tf2_py tf2_ros")


class BufferInterface:
    """Transforms objects of registered types. Subclasses look transforms up."""

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    def transform(
        self,
        object_stamped: Any,
        target_frame: str,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008 # as its documentation shows it
        new_type: type[Any] | None = None,
    ) -> Any:
        """The object in another frame at its own time, and as another type if one is given.

        Raises:
            TypeException: nobody registered the type.
            TransformException: the transform does not exist.
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
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
        new_type: type[Any] | None = None,
    ) -> Any:
        """The object in another frame at another time, where `fixed_frame` does not move between the two.

        Raises:
            TypeException: nobody registered the type.
            TransformException: the transform does not exist.
        """
        do_transform = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        moved = do_transform(object_stamped, found)
        return convert(moved, new_type) if new_type else moved

    def lookup_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
    ) -> Any:
        """The transform that brings data of the source into the target."""
        raise NotImplementedException

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
    ) -> Any:
        """As `lookup_transform`, of the source at one time in the target at another."""
        raise NotImplementedException

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
    ) -> Any:
        """Whether `lookup_transform` would succeed."""
        raise NotImplementedException

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
    ) -> Any:
        """Whether `lookup_transform_full` would succeed."""
        raise NotImplementedException


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:
    """Gives an object a header, and returns it."""
    obj.header = Header(frame_id=frame_id, stamp=stamp)
    return obj


class TypeException(Exception):
    """Nobody registered the type; `errstr` says which."""

    def __init__(self, errstr: str) -> None:
        super().__init__(errstr)
        self.errstr = errstr


class NotImplementedException(Exception):
    """The buffer cannot be asked so."""

    def __init__(self) -> None:
        self.errstr = "CanTransform or LookupTransform not implemented"
        super().__init__(self.errstr)


def _registered(functions: dict[Any, Any], key: Any) -> Any:
    try:
        return functions[key]
    except KeyError:
        raise TypeException(
            f"no transform or conversion is registered for {key}: import the module that has it, "
            "such as tf2_geometry_msgs"
        ) from None


class TransformRegistration:
    """How objects are transformed, by their types. All instances share what was registered."""

    _by_type: ClassVar[dict[Any, Callable[[Any, Any], Any]]] = {}

    def print_me(self) -> None:
        """Prints what was registered."""
        print(self._by_type)

    def add(self, key: Any, callback: Callable[[Any, Any], Any]) -> None:
        """Registers `callback(object, TransformStamped)` for a type."""
        self._by_type[key] = callback

    def get(self, key: Any) -> Callable[[Any, Any], Any]:
        """What was registered for a type. Raises TypeException where nothing was."""
        function: Callable[[Any, Any], Any] = _registered(self._by_type, key)
        return function


class ConvertRegistration:
    """How objects are converted, by their types. All instances share what was registered."""

    _to_msg: ClassVar[dict[Any, Callable[[Any], Any]]] = {}
    _from_msg: ClassVar[dict[Any, Callable[[Any], Any]]] = {}
    _convert: ClassVar[dict[Any, Callable[[Any], Any]]] = {}

    def add_from_msg(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Registers how an object of a type is made of a message."""
        self._from_msg[key] = callback

    def add_to_msg(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Registers how a message is made of an object of a type."""
        self._to_msg[key] = callback

    def add_convert(self, key: Any, callback: Callable[[Any], Any]) -> None:
        """Registers a conversion for a pair of types."""
        self._convert[key] = callback

    def get_from_msg(self, key: Any) -> Callable[[Any], Any]:
        """What was registered. Raises TypeException where nothing was."""
        function: Callable[[Any], Any] = _registered(self._from_msg, key)
        return function

    def get_to_msg(self, key: Any) -> Callable[[Any], Any]:
        """What was registered. Raises TypeException where nothing was."""
        function: Callable[[Any], Any] = _registered(self._to_msg, key)
        return function

    def get_convert(self, key: Any) -> Callable[[Any], Any]:
        """What was registered. Raises TypeException where nothing was."""
        function: Callable[[Any], Any] = _registered(self._convert, key)
        return function


def convert(a: Any, b_type: type[Any]) -> Any:
    """The object as another type, directly where such a conversion is registered, or by way of a message.

    Raises:
        TypeException: nobody registered what it takes.
    """
    registration = ConvertRegistration()
    try:
        directly = registration.get_convert((type(a), b_type))
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
        return registration.get_from_msg(b_type)(registration.get_to_msg(type(a))(a))
    return directly(a)
