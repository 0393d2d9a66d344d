"""`Server`, which lets other nodes change the parameters of this node."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from threading import RLock
from typing import Any

import rospy
from dynamic_reconfigure import DynamicReconfigureCallbackException
from dynamic_reconfigure.encoding import (
    decode_config,
    encode_config,
    encode_description,
    extract_params,
    get_tree,
    initial_config,
)
from dynamic_reconfigure.msg import Config as ConfigMsg
from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
from dynamic_reconfigure.srv import Reconfigure as ReconfigureSrv
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.reconfigure.config import BadValue
from pipros_libraries.reconfigure.config import converted as converted_value

_star_names(__name__, "copy roslib threading")


class Server:
    """Server that calls `callback(config, level)` immediately, and whenever a client changes parameters.

    `level` is the bitwise OR of the levels of the changed parameters; in the first call, all bits are set.
    The callback must return the new configuration. It may call `update_configuration`.

    Args:
        type: module of the configuration, such as `my_pkg.cfg.FooConfig`.
        namespace: namespace of the server's topics and service; private unless it starts with a slash.
    """

    def __init__(self, type: Any, callback: Callable[[Any, int], Any], namespace: str = "") -> None:  # noqa: A002
        self.mutex = RLock()
        if namespace and namespace[0] not in "/~":
            namespace = f"~{namespace}"
        self.ns = f"{namespace}/".replace("//", "/") if namespace not in ("", "~") else "~"
        self.type = type
        self.config = dict(type.defaults)
        self.description = encode_description(type)
        self._copy_from_parameter_server()
        self.callback = callback
        self._clamp(self.config)
        self.config["groups"] = get_tree(self.description)
        self.config = initial_config(encode_config(self.config), type.config_description)
        self.descr_topic = rospy.Publisher(
            f"{self.ns}parameter_descriptions", ConfigDescrMsg, latch=True, queue_size=10
        )
        self.descr_topic.publish(self.description)
        self.update_topic = rospy.Publisher(
            f"{self.ns}parameter_updates", ConfigMsg, latch=True, queue_size=10
        )
        self._change_config(self.config, ~0)
        self.set_service = rospy.Service(f"{self.ns}set_parameters", ReconfigureSrv, self._set_callback)

    def update_configuration(self, changes: Any) -> Any:
        """Change parameters as a client would, and return the whole configuration.

        Raises:
            DynamicReconfigureCallbackException: the callback returned None.
        """
        with self.mutex:
            config = deepcopy(self.config)
            config.update(changes)
            self._clamp(config)
            return self._change_config(config, self._calc_level(config, self.config))

    def _names(self) -> list[dict[str, Any]]:
        return extract_params(self.type.config_description)

    def _copy_from_parameter_server(self) -> None:
        for parameter in self._names():
            name = parameter["name"]
            value = rospy.get_param(self.ns + name, self.config[name])
            self.config[name] = float(value) if parameter["type"] == "double" else value

    def _copy_to_parameter_server(self) -> None:
        for parameter in self._names():
            rospy.set_param(self.ns + parameter["name"], self.config[parameter["name"]])

    def _change_config(self, config: Any, level: int) -> Any:
        changed = self.callback(config, level)
        if changed is None:
            text = "Reconfigure callback should return a possibly updated configuration."
            rospy.logerr(text)
            raise DynamicReconfigureCallbackException(text)
        self.config = changed
        self._copy_to_parameter_server()
        self.update_topic.publish(encode_config(self.config))
        return self.config

    def _calc_level(self, config1: Any, config2: Any) -> int:
        level = 0
        for parameter in self._names():
            if config1[parameter["name"]] != config2[parameter["name"]]:
                level |= parameter["level"]
        return level

    def _clamp(self, config: Any) -> None:
        for parameter in self._names():
            name = parameter["name"]
            low, high, value = self.type.min[name], self.type.max[name], config[name]
            if high != "" and value > high:
                config[name] = high
            elif low != "" and value < low:
                config[name] = low

    def _set_callback(self, req: Any) -> Any:
        changes = decode_config(req.config, self.type.config_description)
        for parameter in self._names():
            if (name := parameter["name"]) in changes:
                try:
                    changes[name] = converted_value(parameter, changes[name])
                except BadValue as error:
                    rospy.logwarn("a client's value is ignored: %s", error)
                    del changes[name]
        return encode_config(self.update_configuration(changes))
