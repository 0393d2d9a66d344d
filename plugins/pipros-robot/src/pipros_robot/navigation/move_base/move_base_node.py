"""The node move_base: connects a `GoalMachine` to costmaps, planners and recovery behaviours."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any, TypeVar

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.actions.goal_server import GoalServer
from pipros_libraries.actions.server_goal import GoalEvent
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter, read_parameters
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import MISSED_S, Schedule
from pipros_libraries.nodes.velocities import VelocityOutput, checked_rate
from pipros_libraries.nodes.wiring import advertise, subscribe
from pipros_libraries.reconfiguring.server import Reconfigurable
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.messages import in_ns, pose_of
from pipros_libraries.transforms.pose import composed
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.layered import Pose2D
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.move_base.machine import STILL, DrivingState, End, GoalMachine, Trigger
from pipros_robot.navigation.move_base.recovery import Tools
from pipros_robot.navigation.move_base.services import PlanService
from pipros_robot.navigation.move_base.settings import INITIAL_PATIENCE, SETTINGS, MoveBaseSettings
from pipros_robot.navigation.plane import Poses, Triple

BAD_QUATERNION = End(GoalEvent.ABORT, "Aborting on goal because it was sent with an invalid quaternion")
T = TypeVar("T")

KILLED = End(GoalEvent.ABORT, "Aborting on the goal because the node has been killed")


class MoveBase:
    """Drives to goals. The cycle and the planner run in one thread each, and callbacks in other threads."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Wait for the transforms and the map, and create all parts. The action is created last.

        Raises:
            InvalidParameter: a parameter has an invalid value.
            Interrupted: the node was shut down while waiting.
        """
        self._node, self._log, self._schedule = node, log, schedule
        given = read_parameters(node, "~")
        checked_rate("~controller_frequency", given.number("controller_frequency", 20.0))
        self._is_strict = given.boolean("strict", False)
        self._lock = threading.RLock()
        self._failures, self._has_failed = Throttle(log, 5.0), False
        self._slow = Throttle(log, MISSED_S)
        plugins.warn_of_names(node, log)
        local_planner = given.text("base_local_planner", MoveBaseSettings().base_local_planner)
        global_planner = given.text("base_global_planner", plugins.GLOBAL_PLANNER)
        ours = self._check_planners(global_planner, local_planner)
        stamped = "geometry_msgs/PoseStamped"
        self._velocities = VelocityOutput(node, "cmd_vel")
        self._current_goal = advertise(node, "~current_goal", stamped, None)
        self._recoveries = advertise(node, "move_base/recovery_status", "move_base_msgs/RecoveryStatus")
        self._forwarded = advertise(node, "move_base/goal", "move_base_msgs/MoveBaseActionGoal")
        self._frames = Frames(node, log)
        self._global_map = Costmap(node, log, self._frames, schedule, "global_costmap")
        self._planner = plugins.global_planner(node, log, self._global_map, global_planner)
        self._local_map = Costmap(node, log, self._frames, schedule, "local_costmap")
        self._controller = plugins.local_planner(node, log, self._local_map, local_planner, ours)
        self._controllers = {ours: self._controller}
        self._maps = self._global_map, self._local_map
        self._goal: Any = None
        self._target: Triple | None = None
        self._planned_s = -math.inf
        self._machine, self._has_settings = GoalMachine(self, MoveBaseSettings()), False
        Reconfigurable(node, "~", SETTINGS, self._apply)
        radius = read_parameters(node, "~local_costmap").number("circumscribed_radius", 0.46)
        PlanService(
            node, log, self._planner, self._maps, given.number("clearing_radius", radius), self._target_of,
            lambda: self._goals.is_active, lambda: self._machine.settings,
        )  # fmt: skip
        listed = given.values.get("recovery_behaviors")
        values = {**asdict(self._machine.settings), "circumscribed_radius": radius}
        tools = Tools(node, log, *self._maps, self.drive, lambda: self._controller.fastest_turn)
        self._behaviours = plugins.behaviours(listed, values, tools, is_strict=self._is_strict)
        self._rest(is_resting=True)
        self._goals = GoalServer(node, "move_base", "move_base_msgs/MoveBase", schedule, self._on_goal)
        # Goals that arrive earlier would be lost, because the action's topic is not connected yet.
        own = self._forwarded
        self._global_map.wait_until(lambda: own.connection_count > 0, "the action server of move_base")
        subscribe(node, "move_base_simple/goal", stamped, self._forward)
        period_s = self._period_s()
        self._change_planning = schedule.every(period_s, self._plan_if_due, self._halt)
        self._change_cycle = schedule.every(period_s, self._cycle, self._halt, name="Control loop")
        node.on_shutdown(self._on_shutdown)

    # -- parameters --------------------------------------------------------------

    def _check_planners(self, global_planner: str, local_planner: str) -> str:
        """Return the local planner to use."""
        known: Iterable[str] = [plugins.GLOBAL_PLANNER]
        strict = self._is_strict
        plugins.check_planner(global_planner, known, "base_global_planner", self._log, is_strict=strict)
        known = plugins.LOCAL_PLANNERS
        return plugins.check_planner(local_planner, known, "base_local_planner", self._log, is_strict=strict)

    def _make_planner(self, values: Mapping[str, Any]) -> str:
        """Return the local planner for new settings. Commands go on while it asks the master."""
        name = values["base_local_planner"]
        ours = self._check_planners(values["base_global_planner"], name)
        if ours not in self._controllers:
            made = plugins.local_planner(self._node, self._log, self._local_map, name, ours)
            self._controllers[ours] = made
        return ours

    def _use_planner(self, ours: str) -> None:
        before, self._controller = self._controller, self._controllers[ours]
        if self._controller is not before:
            self._controller.take_plan(before)

    def _apply(self, values: Mapping[str, Any], _: int) -> Mapping[str, Any]:
        before, settings = self._machine.settings, MoveBaseSettings(**values)
        if not self._has_settings:
            self._has_settings = True
            patience = read_parameters(self._node, "~").number("controller_patience", INITIAL_PATIENCE)
            self._machine.settings = replace(settings, controller_patience=patience)
            return values
        planners, changed = ("base_global_planner", "base_local_planner"), None
        if any(values[name] != getattr(before, name) for name in planners):
            try:
                changed = self._make_planner(values)
            except InvalidParameter as error:
                self._log.error("%s", error)
                settings = replace(settings, **{name: getattr(before, name) for name in planners})
        try:
            checked_rate("controller_frequency", settings.controller_frequency)
        except InvalidParameter as error:
            self._log.error("%s", error)
            settings = replace(settings, controller_frequency=before.controller_frequency)
        with self._lock:
            if changed is not None:
                self._use_planner(changed)
            self._machine.settings = settings
            if settings.controller_frequency != before.controller_frequency:
                self._change_planning(self._period_s())
                self._change_cycle(self._period_s())
        return asdict(settings)

    def _period_s(self) -> float:
        return 1.0 / self._machine.settings.controller_frequency

    # -- goals -------------------------------------------------------------------

    def _forward(self, message: Any) -> None:
        """Forward a goal from `move_base_simple/goal` to the action, with an empty ID."""
        goal: Any = load_message_class("move_base_msgs/MoveBaseActionGoal")()
        goal.header.stamp, goal.goal.target_pose = stamp(self._node.clock), message
        self._forwarded.publish(goal)

    def _on_goal(self) -> None:
        """Accept a new goal immediately if no other goal is active."""
        with self._lock:
            if not self._goals.is_active and self._goals.has_new_goal:
                self._accept(self._node.clock.now_ns() / 1e9)

    def _cycle(self) -> None:
        with self._lock:
            now_s = self._node.clock.now_ns() / 1e9
            if not self._machine.is_recovering and self._goals.has_new_goal:
                self._accept(now_s)
            if self._goals.is_active and self._goals.is_cancelled:
                self._finish(End(GoalEvent.CANCEL, ""))
            if not self._goals.is_active or not now_s:
                return
            if not self._machine.is_recovering:
                self._publish_feedback()
                if self._target is None:
                    self._target = self._target_of(self._goal)
            end = self._machine.cycle(now_s)
            if end is not None:
                self._finish(end)

    def _accept(self, now_s: float) -> None:
        is_replacement = self._goals.is_active
        self._goal = self._goals.accept().target_pose
        if not plane.is_upright(self._goal.pose.orientation):
            self._log.error("the goal's quaternion must be finite, not 0, and keep the z axis upright")
            self._finish(BAD_QUATERNION)
            return
        self._target = self._target_of(self._goal)
        self._planned_s = -math.inf
        if not is_replacement:
            self._rest(is_resting=False)
            if silent := self._local_map.silent_topics:
                text = "the robot does not see with these sensors, as nothing has arrived on %s so far"
                self._slow.warning(text, ", ".join(silent))
        self._machine.begin(now_s, replaces=is_replacement)
        shown = self._goal
        if self._target is not None:
            shown = plane.stamped_pose(self._target, self._global_map.global_frame, self._goal.header.stamp)
        self._current_goal.publish(shown)

    def _target_of(self, goal: Any) -> Triple | None:
        """Return a goal's pose in the global frame at the goal's time. If unknown, warn and return None."""
        frame, pose = goal.header.frame_id.lstrip("/"), pose_of(goal.pose.position, goal.pose.orientation)
        if frame == self._global_map.global_frame:
            return plane.flat(pose)
        try:
            outer = self._frames.at(self._global_map.global_frame, frame, in_ns(goal.header.stamp))
        except TransformException as error:
            self._global_map.warn("the goal cannot be transformed to the global frame: %s", error)
            return None
        return plane.flat(composed(outer, pose))

    def _finish(self, end: End) -> None:
        """End the goal. The robot is stopped first, whatever the reason is."""
        self._machine.stop()
        self._goals.end(end.event, end.text)
        self._rest(is_resting=True)

    def _rest(self, *, is_resting: bool) -> None:
        """Stop the costmaps after a goal, or start them for a goal, if `shutdown_costmaps` is set."""
        if self._machine.settings.shutdown_costmaps:
            for costmap in self._maps:
                costmap.stop() if is_resting else costmap.start()

    def _publish_feedback(self) -> None:
        pose = self._global_map.robot_pose()
        if pose is not None:
            stamped = plane.stamped_pose(pose, self._global_map.global_frame, stamp(self._node.clock))
            self._goals.publish_feedback(load_message_class("move_base_msgs/MoveBaseFeedback")(stamped))

    def _on_shutdown(self) -> None:
        with self._lock:
            if self._goals.is_active:
                self._halt()
                self._goals.end(KILLED.event, KILLED.text)

    # -- the planner -------------------------------------------------------------

    def _plan_if_due(self) -> None:
        with self._lock:
            machine, now_s, target = self._machine, self._node.clock.now_ns() / 1e9, self._target
            frequency = machine.settings.planner_frequency
            rests = self._planned_s <= now_s < self._planned_s + 1 / max(frequency, 1e-6)
            is_due = machine.state is DrivingState.PLANNING or not rests
            if not (self._goals.is_active and machine.wants_plan and is_due):
                return
            self._planned_s = now_s
        begun_s = time.monotonic()
        plan = self._tried("the global planner", lambda: self._make_plan(target))
        if (taken_s := time.monotonic() - begun_s) * frequency > 1:
            text = "~planner_frequency is %g Hz, but a plan took %.2f s: lower it, or shrink the costmap"
            self._slow.warning(text, frequency, taken_s)
        with self._lock:
            machine.planned(plan, self._node.clock.now_ns() / 1e9, is_current=target == self._target)

    def _make_plan(self, target: Triple | None) -> Poses | None:
        start = None if target is None else self._global_map.robot_pose()
        if start is None or target is None:
            return None
        goal = Pose2D(*target)
        return self._planner.make_plan(start, goal)

    # -- failures ----------------------------------------------------------------

    def _halt(self) -> None:
        self.drive(STILL)

    def _tried(self, part: str, do: Callable[[], T]) -> T | None:
        """Return the result of a planner or behaviour. If it raises, stop, log the error, and return None."""
        try:
            return do()
        except Exception as error:
            self._halt()
            self._failures.error("%s failed: %s: %s", part, type(error).__name__, error)
            return None

    # -- called by the machine ---------------------------------------------------

    def pose(self) -> Triple | None:
        return self._global_map.robot_pose()

    def can_see(self) -> bool:
        if not self._local_map.is_current:
            text = "sensor data is too old, or the costmap is not updated: the robot does not drive"
            if blind := self._local_map.blind_without:
                text = f"the costmap has no sensor without {', '.join(blind)}: the robot does not drive"
            self._local_map.warn(text)
        return self._local_map.is_current

    def follow(self, plan: Poses) -> bool:
        frame = self._global_map.global_frame
        return bool(self._tried("the local planner", lambda: self._controller.set_plan(frame, plan)))

    def has_arrived(self) -> bool:
        found = self._tried("the local planner", self._controller.is_goal_reached)
        self._has_failed = found is None  # then, its command is not trusted either
        return bool(found)

    def command(self) -> Triple | None:
        found = None if self._has_failed else self._tried("the local planner", self._controller.command)
        return found if found is None or all(map(math.isfinite, found)) else None

    def drive(self, velocity: Triple) -> None:
        self._velocities.publish(plane.twist(self._controller.limited(velocity)))

    def begin_recovery(self, index: int, trigger: Trigger) -> bool:
        if index not in self._behaviours:
            return False
        name, self._behaviour = self._behaviours[index]
        self._log.warning("recovery behaviour [%s] begins; its trigger is %s", name, trigger.name.lower())
        if self._recoveries.connection_count:
            pose = self._global_map.robot_pose() or STILL
            stamped = plane.stamped_pose(pose, self._global_map.global_frame, stamp(self._node.clock))
            status: Any = load_message_class("move_base_msgs/RecoveryStatus")
            self._recoveries.publish(status(stamped, index, len(self._behaviours), name))
        self._tried(name, self._behaviour.begin)
        return True

    def recover(self) -> bool:
        return self._tried("the recovery behaviour", self._behaviour.recover) is not False


def main() -> int:
    """Run the node until it is shut down. Return 1 if a parameter is invalid."""
    return run_node("move_base_node", "move_base", MoveBase)
