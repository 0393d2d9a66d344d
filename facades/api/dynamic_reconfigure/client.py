"""`Client`: reads and changes the parameters of another node."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from threading import Condition
from typing import Any

import rospy
from dynamic_reconfigure import DynamicReconfigureCallbackException, DynamicReconfigureParameterException
from dynamic_reconfigure.encoding import decode_config, decode_description, encode_config, extract_params
from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv
from pipros.basics.lazy_names import star_names as _star_names
from pipros.reconfigure.config import BadValue
from pipros.reconfigure.config import converted as converted_value
from pipros.reconfigure.generator import TYPES
from rospy import ServiceException

_star_names(__name__, "roslib threading")

_SLICE_S = 0.1
"""How long a wait lasts before it looks for Ctrl-C and a shutdown."""


class Client:
    """Follows the parameters of the server `name`.

    Args:
        timeout: seconds to wait for the server; None for ever.
        config_callback: called with the configuration when it comes, and at each change.
        description_callback: called with the list of parameters.

    Raises:
        ROSException: there is no server in that time.
    """

    def __init__(
        self,
        name: str,
        timeout: float | None = None,
        config_callback: Callable[[Any], object] | None = None,
        description_callback: Callable[[Any], object] | None = None,
    ) -> None:
        self.name = name
        self.config: Any = None
        self.param_description: Any = None
        self.group_description: Any = None
        self._early: Any = None
        self._cv = Condition()
        self._config_callback = config_callback
        self._description_callback = description_callback
        service = rospy.resolve_name(f"{name}/set_parameters")
        rospy.wait_for_service(service, timeout or None)
        self._set_service = rospy.ServiceProxy(service, ReconfigureSrv)
        topic = rospy.resolve_name(name)
        self._descriptions_sub = rospy.Subscriber(
            f"{topic}/parameter_descriptions", ConfigDescrMsg, self._descriptions_msg
        )
        self._updates_sub = rospy.Subscriber(f"{topic}/parameter_updates", ConfigMsg, self._updates_msg)

    def get_configuration(self, timeout: float | None = None) -> Any:
        """The configuration; None where it does not come within `timeout` seconds (for ever: None)."""
        return self._wait("config", timeout)

    def get_parameter_descriptions(self, timeout: float | None = None) -> Any:
        """The parameters; None where they do not come in time."""
        return self._wait("param_description", timeout)

    def get_group_descriptions(self, timeout: float | None = None) -> Any:
        """The tree of groups; None where it does not come in time."""
        return self._wait("group_description", timeout)

    def _wait(self, what: str, timeout: float | None) -> Any:
        end = time.monotonic() + timeout if timeout else None
        with self._cv:
            while getattr(self, what) is None and not rospy.is_shutdown():
                left = _SLICE_S if end is None else end - time.monotonic()
                if left <= 0.0:
                    break
                self._cv.wait(min(left, _SLICE_S))
            return getattr(self, what)

    def update_configuration(self, changes: dict[str, Any]) -> Any:
        """Changes parameters, and returns what the server says of them.

        Texts are taken for what the parameter's type is; for enums also the name of a constant.

        Raises:
            DynamicReconfigureParameterException: the parameter does not exist, or cannot have this value.
            DynamicReconfigureCallbackException: the server refused.
        """
        described = {each["name"]: each for each in self.get_parameter_descriptions() or ()}
        converted = {}
        for name, value in changes.items():
            if name == "groups":
                converted[name] = self.update_groups(value)
            elif name not in described:
                raise DynamicReconfigureParameterException(f"don't know parameter: {name}")
            else:
                converted[name] = self._converted(described[name], value)
        changes.update(converted)
        try:
            message = self._set_service(encode_config(converted)).config
        except ServiceException as error:
            raise DynamicReconfigureCallbackException(f"service call failed: {error}") from error
        return decode_config(message, self.get_group_descriptions())

    def _converted(self, described: Any, value: Any) -> Any:
        try:
            return converted_value(described, value)
        except BadValue as error:
            raise DynamicReconfigureParameterException(str(error)) from error

    def update_groups(self, changes: Any) -> Any:
        """The tree of groups with new states, by the groups' names."""
        tree = self.get_group_descriptions()

        def change(group: Any) -> None:
            for inner in group["groups"].values():
                if inner["name"] in changes:
                    inner["state"] = changes[inner["name"]]
                change(inner)

        change(tree)
        return tree

    def close(self) -> None:
        """Follows the server no more."""
        self._descriptions_sub.unregister()
        self._updates_sub.unregister()

    @property
    def config_callback(self) -> Callable[[Any], object] | None:
        """Called with each new configuration; one that is set is called at once."""
        return self._config_callback

    @config_callback.setter
    def config_callback(self, value: Callable[[Any], object] | None) -> None:
        self._config_callback = value
        if value is not None:
            value(self.config)

    def get_config_callback(self) -> Callable[[Any], object] | None:
        """`config_callback`."""
        return self.config_callback

    def set_config_callback(self, value: Callable[[Any], object] | None) -> None:
        """Sets `config_callback`."""
        self.config_callback = value

    @property
    def description_callback(self) -> Callable[[Any], object] | None:
        """Called with the parameters; one that is set is called at once."""
        return self._description_callback

    @description_callback.setter
    def description_callback(self, value: Callable[[Any], object] | None) -> None:
        self._description_callback = value
        if value is not None:
            value(self.param_description)

    def get_description_callback(self) -> Callable[[Any], object] | None:
        """`description_callback`."""
        return self.description_callback

    def set_description_callback(self, value: Callable[[Any], object] | None) -> None:
        """Sets `description_callback`."""
        self.description_callback = value

    def _updates_msg(self, msg: Any) -> None:
        with self._cv:
            if self.group_description is None:  # the description comes on a topic of its own
                self._early = msg
                return
            self.config = decode_config(msg, self.group_description)
            self._cv.notify_all()
        if self._config_callback is not None:
            self._config_callback(self.config)

    def _descriptions_msg(self, msg: Any) -> None:
        description = decode_description(msg)
        described = extract_params(description) if description else []
        for each in described:
            if each["type"] not in TYPES:
                print(f"{self.name}: {each['name']} has the unknown type {each['type']}", file=sys.stderr)
        with self._cv:
            self.group_description = description
            self.param_description = described
            early, self._early = self._early, None
            self._cv.notify_all()
        if self._description_callback is not None:
            self._description_callback(described)
        if early is not None:
            self._updates_msg(early)
