"""Joint values for joint_state_publisher: defaults, values from sources, and values of mimic joints.

The rules are described at http://wiki.ros.org/joint_state_publisher.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, pi
from typing import Any

from pipros.basics.errors import PiprosError
from pipros_libraries.robot_model.urdf import Joint, Robot


class MimicCircle(PiprosError, ValueError):
    """The `mimic` references between joints form a cycle."""


@dataclass(frozen=True, slots=True)
class JointChoices:
    """The node's parameters that determine the joints and their initial values.

    Attributes:
        zeros: initial positions, by joint. The default is 0, or the middle of the joint's range if the range
            does not contain 0.
        dependent: rules for joints that follow another joint, by joint. A rule has the key `parent` and
            optionally `factor` and `offset`.
        mimic_tags: whether to also use the `<mimic>` tags in the URDF.
        smallest_limits: whether to narrow ranges to the soft limits of the joints' safety controllers.
        positions, velocities, efforts: whether to publish default values until a source has sent values.
    """

    zeros: Mapping[str, float]
    dependent: Mapping[str, Mapping[str, Any]]
    mimic_tags: bool = True
    smallest_limits: bool = True
    positions: bool = True
    velocities: bool = False
    efforts: bool = False


class JointValues:
    """A robot's moving joints and their current values.

    Attributes:
        names: all published joints, in the order in which the URDF lists them.
        free: values of joints that do not follow another joint: `min`, `max`, `zero` and, if known,
            `position`, `velocity`, `effort`. Programs that use joint_state_publisher read and write these
            values.
        dependent: rules for joints that follow another joint.
        without_limits: joints that lack the required limits and are not published.
        problems: why entries of `zeros` and `dependent` in the choices are left out.

    Raises:
        MimicCircle: dependent joints follow each other in a cycle.
    """

    def __init__(self, robot: Robot, choices: JointChoices) -> None:
        self.names: list[str] = []
        self.free: dict[str, dict[str, Any]] = {}
        self.problems: list[str] = []
        self.dependent: dict[str, Mapping[str, Any]] = self._valid(
            "dependent_joints", choices.dependent, _is_rule, "a mapping with parent, factor and offset"
        )
        self._zeros: dict[str, float] = self._valid("zeros", choices.zeros, _is_number, "a finite number")
        self.without_limits: list[str] = []
        self._roots: dict[str, tuple[str, float, float]] = {}
        self._rules_of_roots: dict[str, Mapping[str, Any]] = {}
        for joint in robot.joints:
            if joint.type not in ("fixed", "floating", "planar"):
                self._add(joint, choices)
        for name in self.dependent:
            self._root_of(name)

    def _valid(self, name: str, given: Any, is_valid: Callable[[Any], bool], expected: str) -> dict[str, Any]:
        """Return the valid entries of a choice, and add the others to `problems`."""
        if not isinstance(given, Mapping):
            self.problems.append(f"{name} must be a mapping, got {given!r:.200}")
            return {}
        for joint, value in given.items():
            if not is_valid(value):
                self.problems.append(f"{name}: {joint} must be {expected}, got {value!r:.200}")
        return {joint: value for joint, value in given.items() if is_valid(value)}

    def _add(self, joint: Joint, choices: JointChoices) -> None:
        name = joint.name
        if joint.type != "continuous" and joint.limits is None:
            self.without_limits.append(name)
            return
        self.names.append(name)
        lowest, highest = (-pi, pi) if joint.type == "continuous" else joint.limits or (0.0, 0.0)
        if choices.smallest_limits:
            lower, upper = joint.soft_limits
            lowest = lowest if lower is None else max(lowest, lower)
            highest = highest if upper is None else min(highest, upper)
        if choices.mimic_tags and joint.mimic is not None:
            mimic = joint.mimic
            self.dependent[name] = {"parent": mimic.joint, "factor": mimic.multiplier, "offset": mimic.offset}
            return
        if name in self.dependent:
            return
        zero = self._zeros.get(name) or ((lowest + highest) / 2 if lowest > 0 or highest < 0 else 0)
        values: dict[str, Any] = {"min": lowest, "max": highest, "zero": zero}
        if choices.positions:
            values["position"] = zero
        if choices.velocities:
            values["velocity"] = 0.0
        if choices.efforts:
            values["effort"] = 0.0
        if joint.type == "continuous":
            values["continuous"] = True
        self.free[name] = values

    def update(self, names: Sequence[str], **columns: Sequence[float]) -> None:
        """Update the values of free joints from a source. Other joints are ignored.

        `columns` may contain `position`, `velocity` and `effort`, each either empty or as long as `names`.
        """
        for number, name in enumerate(names):
            joint = self.free.get(name)
            if joint is None:
                continue
            for what, values in columns.items():
                if number < len(values):
                    joint[what] = values[number]

    def sweep(self, delta: float) -> None:
        """Move each free joint by `delta`: back and forth within its range, or only forward if continuous."""
        for joint in self.free.values():
            if "position" not in joint:
                continue
            forward = joint.get("forward", True)
            joint["position"] += delta if forward else -delta
            if forward and joint["position"] > joint["max"]:
                if joint.get("continuous"):
                    joint["position"] = joint["min"]
                else:
                    joint["position"], joint["forward"] = joint["max"], False
            elif not forward and joint["position"] < joint["min"]:
                joint["position"], joint["forward"] = joint["min"], True

    def columns(self) -> tuple[list[float], list[float], list[float]]:
        """Return the positions, velocities and efforts of all `names`.

        A list is empty if none of its values is known and, for positions, no joint follows another.
        """
        if self.dependent != self._rules_of_roots:  # programs may change the rules
            self._rules_of_roots = {name: dict(rule) for name, rule in self.dependent.items()}
            self._roots.clear()
        known = {what for joint in self.free.values() for what in joint}
        wants = ("position" in known or bool(self.dependent), "velocity" in known, "effort" in known)
        rows = [self._row(name) for name in self.names]
        position, velocity, effort = (
            [row[column] for row in rows] if wanted else [] for column, wanted in enumerate(wants)
        )
        return position, velocity, effort

    def _row(self, name: str) -> tuple[float, float, float]:
        factor, offset = 1.0, 0.0
        root = name
        if name in self.dependent:
            root, factor, offset = self._root_of(name)
        joint = self.free.get(root, {})
        position = joint["position"] * factor + offset if "position" in joint else 0.0
        return (position, joint.get("velocity", 0.0) * factor, joint.get("effort", 0.0))

    def _root_of(self, name: str) -> tuple[str, float, float]:
        """Return the free joint that a dependent joint ultimately follows, with factor and offset."""
        if name not in self._roots:
            self._roots[name] = self._found_root(name)
        return self._roots[name]

    def _found_root(self, name: str) -> tuple[str, float, float]:
        factor, offset = 1.0, 0.0
        seen: dict[str, None] = {}
        while name in self.dependent:
            if name in seen:
                raise MimicCircle(f"mimic joints form a cycle: {' -> '.join([*seen, name])}")
            seen[name] = None
            rule = self.dependent[name]
            offset += factor * rule.get("offset", 0)  # in Noetic's order, so that the sums are the same
            factor *= rule.get("factor", 1)
            name = str(rule.get("parent", ""))
        return name, factor, offset


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value)


def _is_rule(value: object) -> bool:
    return isinstance(value, Mapping) and all(_is_number(value.get(key, 0)) for key in ("factor", "offset"))
