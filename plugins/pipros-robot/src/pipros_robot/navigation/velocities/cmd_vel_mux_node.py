"""The nodelet `yocs_cmd_vel_mux/CmdVelMuxNodelet`, which forwards velocities from the active source."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from functools import partial
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros.node.rate import Timer
from pipros_libraries.nodes.velocities import VelocityOutput
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_libraries.teleoperation.velocity_mux import VelocitySource
from pipros_robot.navigation.velocities.cmd_vel_mux import CmdVelMux, read_sources

CHECK_NS: Final = NS_PER_S // 20
"""Interval at which the node checks whether the active source has expired."""

IDLE: Final = "idle"
SETTINGS: Final = (
    Setting("yaml_cfg_file", "", description="file with the sources and the output, in YAML"),
    Setting("yaml_cfg_data", "", description="text in YAML that is used instead of the file"),
)


class CmdVelMuxNode:
    """Publishes the velocities of the active source, and its name on `~active`."""

    def __init__(self, node: Node) -> None:
        """Read the configuration, advertise and subscribe. Blocks until the master answers."""
        self._node, self._mux, self._lock = node, CmdVelMux(), threading.RLock()
        self._twist: Any = load_message_class("geometry_msgs/Twist")
        self._text: Any = load_message_class("std_msgs/String")
        self._inputs: list[Any] = []
        self._output: Any = None
        self._reported = ""
        self._names = node.advertise("~active", self._text, queue_size=1, latch=True)
        self._settings = Reconfigurable(node, "~", SETTINGS, self._reload)
        self._timer = Timer(node.clock, CHECK_NS, lambda _: self._check(), reset=True)

    def _reload(self, values: Mapping[str, Value], _level: int) -> None:
        """Read the configuration again. If it is invalid, the previous one stays in force."""
        log, file = self._node.log, str(values["yaml_cfg_file"])
        try:
            text = str(values["yaml_cfg_data"]) or read_text(file)
            inputs, output = read_sources(text, lambda problem: log.error("left out: %s", problem))
        except (OSError, PiprosError, UnicodeDecodeError) as error:
            log.error("invalid configuration (~yaml_cfg_file is [%s]): %s", file, error)
            return
        with self._lock:
            before, self._inputs = [*self._inputs, self._output], []
            self._output = VelocityOutput(self._node, names.join("~", output))
            self._mux.replace(inputs)
            for each in inputs:
                take = partial(self._on_velocity, each)
                topic = names.join("~", each.topic)
                self._inputs.append(self._node.subscribe(topic, self._twist, take, queue_size=10))
            self._report()
        for handle in filter(None, before):  # after the new ones, which keep the connections
            handle.unregister()

    def _on_velocity(self, one: VelocitySource, message: Any) -> None:
        with self._lock:
            if self._mux.passes(one, self._now_s()):
                self._report()
                self._output.publish(message)

    def _check(self) -> None:
        """Report that no source is active. If all are silent, stop the base.

        Without it, a base that holds its last command would drive on.
        """
        with self._lock:
            if self._mux.expire(self._now_s()) and self._output is not None:
                self._output.stop()
            self._report()

    def _report(self) -> None:
        name = self._mux.active.name if self._mux.active else IDLE
        if name != self._reported:
            self._reported = name
            self._names.publish(self._text(name))

    def _now_s(self) -> float:
        return self._node.clock.now_ns() / NS_PER_S

    def close(self) -> None:
        """Stop the robot, and stop publishing."""
        self._timer.shutdown()
        if self._output is not None:
            self._output.unregister()
