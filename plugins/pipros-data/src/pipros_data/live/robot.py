"""Connect a policy to a robot: receive observations, publish actions, and stop the robot if necessary."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.node import Node
from pipros.node.start_params import is_on
from pipros.safe.settings import BadSettings
from pipros_data.datasets.config import DatasetConfig, SignalSource, read_config
from pipros_data.live.commands import ActionRefused, DriveCommand
from pipros_data.live.sources import LiveSource, RobotSilent, full_names, wait_for_all, wait_until
from pipros_server.policy.model import ActKind, ActRule
from pipros_server.stop_guardian import StopGuardian

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from typing_extensions import Self


class LiveRobot:
    """A robot controlled by ROS 1 nodes and described by a `robot.yaml`. Not thread-safe.

    As a context manager, it stops the robot at the end of the block.

    The numbers have the same order and units as in the data set: `state_names` for `observation.state`,
    `action_names` for `action`.

    The robot is stopped if an action is refused, or if `observe` or `act` finds a silent topic. Unless
    `watchdog` is 0, the robot is also stopped if no action follows within `watchdog` seconds or this process
    ends for any reason: `pipros_server.guardian_process` monitors this process.

    Attributes:
        config: the description.
        node: the node that communicates with the robot.
        state_names, action_names: the names of the numbers, such as `arm.elbow`.
        action_limits: the minimum and the maximum of each number; infinite if there are no limits.
        cameras: the height, width and number of channels of each camera's pictures.
    """

    def __init__(self, path: str | Path, *, master_uri: str | None = None, timeout_s: float = 5.0) -> None:
        """Connect, and wait for a message on each topic.

        Raises:
            BadSettings: the description is invalid, or does not fit the robot.
            RobotSilent: after `timeout_s`, a topic has no complete message, or the topic of an action has no
                type or no subscriber.
            PictureError: the encoding of a picture is not supported.
            ActRefused: the guardian process does not start.
            Unreachable: there is no master.
        """
        self.config: DatasetConfig = read_config(Path(path))
        environment = Environment(master_uri=master_uri) if master_uri else None
        self.node = Node("pipros_policy", anonymous=True, environment=environment)
        self._guardian = StopGuardian(self.node)
        self._is_acting = False
        self.node.start()
        try:
            if is_on(self.node, "/use_sim_time"):
                self.node.use_simulated_time()
            self._connect(timeout_s)
        except BaseException:
            self.close()
            raise

    def _connect(self, timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        observed = [each for each in self.config.sources if not each.name.startswith("actions.")]
        sources = [LiveSource(self.node, each) for each in observed]
        self._commands = [DriveCommand(self.node, each, end_s) for each in self.config.actions]
        self._sources = wait_for_all(sources, end_s)
        self._signals = [each for each in sources if isinstance(each.source, SignalSource)]
        cameras = self.config.cameras
        self._cameras = {each.source.short_name: each for each in sources if each.source in cameras}
        self.state_names = full_names(self._signals)
        self.action_names = full_names(self._commands)
        self.cameras = {name: each.picture().shape for name, each in self._cameras.items()}
        self._held = {each.source.name: self._measured(each) for each in self._commands if each.stop is None}
        limits = [each.limits for each in self._commands]
        self.action_limits = tuple(np.concatenate(each) for each in zip(*limits, strict=True))
        self._wait_for_robot(end_s)

    def _wait_for_robot(self, end_s: float) -> None:
        limit_s = self.config.watchdog
        for each in self._commands:
            wait_until(each.has_subscriber, end_s, f"nothing subscribes to {each.topic}")
            if limit_s:
                stop = self._stop_message(each)
                rule = ActRule(
                    place=each.source.place,
                    kind=ActKind.TOPIC,
                    name=each.topic,
                    type=each.type,
                    stop=stop,
                    time_limit_s=limit_s,
                )
                self._guardian.watch(rule)

    def _measured(self, command: DriveCommand) -> LiveSource:
        """Return the observation that matches an action. Its last numbers are sent to stop the robot."""
        wanted = command.source.short_name, command.source.unit, len(command.names)
        for each in self._signals:
            if (each.source.short_name, each.source.unit, len(each.names)) == wanted:
                return each
        raise BadSettings(
            f"{command.source.place}.stop: hold needs an observation with the same name, unit and number of "
            "values"
        )

    def _stop_message(self, command: DriveCommand) -> Any:
        values = self._held[command.source.name].numbers() if command.stop is None else command.stop
        return command.message(values, self.node.clock.now_ns())

    def _require_messages(self) -> None:
        for each in self._sources:
            most = np.inf if self.config.gaps == "hold" else each.source.tolerance
            if not (age := each.age_s) < np.inf or age > most:
                what = "is no longer published" if age == np.inf else f"has been silent for {age:.2f} s"
                raise RobotSilent(f"{each.topic} {what} ({each.source.place})")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def observe(self) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Return the latest numbers, in the order of `state_names`, and the latest picture of each camera.

        Raises:
            RobotSilent: a topic has no publisher, its last message is incomplete or, unless `gaps` is `hold`,
                older than its tolerance. The robot is stopped.
            PictureError: the encoding of a picture is not supported. The robot is stopped.
            BadSettings: a message does not fit the description. The robot is stopped.
        """
        try:
            self._require_messages()
            state = [each.numbers() for each in self._signals]
            shapes = self.cameras
            pictures = {n: each.picture((shapes[n][1], shapes[n][0])) for n, each in self._cameras.items()}
        except PiprosError:
            self.stop()
            raise
        return np.concatenate(state) if state else np.zeros(0), pictures

    def act(self, values: object) -> NDArray[np.float64]:
        """Publish an action, and return it as an array. `values` are in the order of `action_names`.

        After an error, the robot is stopped.

        Raises:
            ActionRefused: the count is wrong, or a number is not finite or outside its limits.
            RobotSilent: a topic of the robot is silent, or no node subscribes to a command.
            ActRefused: the guardian process, which would stop the robot, is not running or cannot be reached.
        """
        numbers = np.array(values, np.float64).reshape(-1)
        try:
            self._require_messages()
            if len(numbers) != len(self.action_names):
                what = f"an action must have {len(self.action_names)} numbers, got {len(numbers)}"
                raise ActionRefused(what)
            ends = np.cumsum([len(each.names) for each in self._commands])[:-1]
            parts = list(zip(self._commands, np.split(numbers, ends), strict=True))
            for command, part in parts:
                command.check(part)
                if not command.has_subscriber():
                    raise RobotSilent(f"nothing subscribes to {command.topic}")
            now_ns = self.node.clock.now_ns()
            self._is_acting = True
            for command, part in parts:
                if self.config.watchdog:
                    held = self._stop_message(command)._to_buffers() if command.stop is None else None
                    self._guardian.arm(command.topic, "", self, None if held is None else b"".join(held))
                command.publisher.publish(command.message(part, now_ns))
        except PiprosError:
            self.stop()
            raise
        return numbers

    def stop(self) -> None:
        """Stop the robot as the description specifies, if it has acted since the last stop.

        Raises:
            RobotSilent, BadSettings: the last numbers of an observation cannot be held. For this command, the
                guardian process sends those that could be held last; all others are stopped.
        """
        if not self._is_acting:
            return
        self._is_acting = False
        errors: list[PiprosError] = []
        for each in self._commands:
            try:
                each.publisher.publish(self._stop_message(each))
            except PiprosError as error:
                errors.append(error)
            self._guardian.left(each.topic, self)
        if errors:
            raise errors[0]

    def close(self) -> None:
        """Stop the robot, and disconnect; see `stop` for errors."""
        try:
            self.stop()
        finally:
            self._guardian.close()
            self.node.shutdown()
