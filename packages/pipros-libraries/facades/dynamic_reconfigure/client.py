"""`Client`, which reads and changes the parameters of another node."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from threading import Condition
from typing import Any

import rospy
from dynamic_reconfigure import DynamicReconfigureCallbackException, DynamicReconfigureParameterException
from dynamic_reconfigure.encoding import decode_config, decode_description, encode_config, extract_params
from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv
from pipros.basics.interruptible_wait import wait_in_slices
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.reconfigure.config import BadValue
from pipros_libraries.reconfigure.config import converted as converted_value
from pipros_libraries.reconfigure.generator import TYPES
from rospy import ServiceException

_star_names(__name__, "roslib threading time")

_SILENT_S = 1.0
"""Time that a client without a timeout waits before it says so."""


class Client:
    """Client of the reconfigure server `name`. Receives the server's configuration and every change to it.

    Args:
        timeout: seconds to wait for the server; None or 0 to wait forever.
        config_callback: called with the configuration when it is first received and after each change.
        description_callback: called with the list of parameters.

    Raises:
        ROSException: the server did not appear within `timeout`.
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
        if timeout or not _comes_soon(service):
            rospy.wait_for_service(service, timeout or None)
        self._set_service = rospy.ServiceProxy(service, ReconfigureSrv)
        topic = rospy.resolve_name(name)
        self._descriptions_sub = rospy.Subscriber(
            f"{topic}/parameter_descriptions", ConfigDescrMsg, self._descriptions_msg
        )
        self._updates_sub = rospy.Subscriber(f"{topic}/parameter_updates", ConfigMsg, self._updates_msg)

    def get_configuration(self, timeout: float | None = None) -> Any:
        """Return the configuration, or None if it is not received within `timeout` seconds.

        If `timeout` is None or 0, wait until the configuration is received or the node is shut down.
        """
        if not timeout and self._wait("config", _SILENT_S) is None:
            print("Waiting for configuration...", file=sys.stderr, flush=True)
        return self._wait("config", timeout)

    def get_parameter_descriptions(self, timeout: float | None = None) -> Any:
        """Return the list of parameters, or None if it is not received within `timeout` seconds."""
        return self._wait("param_description", timeout)

    def get_group_descriptions(self, timeout: float | None = None) -> Any:
        """Return the tree of groups, or None if it is not received within `timeout` seconds."""
        return self._wait("group_description", timeout)

    def _wait(self, what: str, timeout: float | None) -> Any:
        def is_ended() -> bool:
            return getattr(self, what) is not None or rospy.is_shutdown()

        with self._cv:
            wait_in_slices(partial(self._cv.wait_for, is_ended), timeout or None)
            return getattr(self, what)

    def update_configuration(self, changes: dict[str, Any]) -> Any:
        """Change parameters, and return the new configuration from the server.

        Blocks until the server responds. Strings are converted to the parameter's type; enums also accept the
        name of a constant. `changes` is updated with the converted values.

        Raises:
            DynamicReconfigureParameterException: a parameter does not exist, or does not accept the value.
            DynamicReconfigureCallbackException: the service call failed.
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
        """Set the states of groups, given by group name, in the local tree of groups, and return the tree."""
        tree = self.get_group_descriptions()

        def change(group: Any) -> None:
            for inner in group["groups"].values():
                if inner["name"] in changes:
                    inner["state"] = changes[inner["name"]]
                change(inner)

        change(tree)
        return tree

    def close(self) -> None:
        """Unsubscribe from the server."""
        self._descriptions_sub.unregister()
        self._updates_sub.unregister()

    def get_config_callback(self) -> Callable[[Any], object] | None:
        """Return the function to call with each new configuration."""
        return self._config_callback

    def set_config_callback(self, value: Callable[[Any], object] | None) -> None:
        """Set the function to call with each new configuration.

        The function is called immediately, with None if no configuration has been received yet.
        """
        self._config_callback = value
        if value is not None:
            value(self.config)

    config_callback = property(get_config_callback, set_config_callback)

    def get_description_callback(self) -> Callable[[Any], object] | None:
        """Return the function to call with each list of parameters."""
        return self._description_callback

    def set_description_callback(self, value: Callable[[Any], object] | None) -> None:
        """Set the function to call with each list of parameters.

        The function is called immediately, with None if no list has been received yet.
        """
        self._description_callback = value
        if value is not None:
            value(self.param_description)

    description_callback = property(get_description_callback, set_description_callback)

    def _updates_msg(self, msg: Any) -> None:
        with self._cv:
            if self.group_description is None:  # `msg` can only be decoded after the description arrives
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
                print(f"{self.name}: {each['name']} has unknown type {each['type']}", file=sys.stderr)
        with self._cv:
            self.group_description = description
            self.param_description = described
            early, self._early = self._early, None
            self._cv.notify_all()
        if self._description_callback is not None:
            self._description_callback(described)
        if early is not None:
            self._updates_msg(early)


def _comes_soon(service: str) -> bool:
    try:
        rospy.wait_for_service(service, _SILENT_S)
    except rospy.ROSException:
        print(f"Waiting for service {service}...", file=sys.stderr, flush=True)
        return False
    return True
