"""Read the links and joints in a URDF; ignore all other parts. See http://wiki.ros.org/urdf/XML/joint.

urdf_parser_py (`pipros[urdf]`) reads all parts into objects that can be changed and written. However, it
needs lxml (12 MB), accepts joints that form a loop, and takes 3.2 ms to parse a chain of 50 joints, which
this module parses in 1.2 ms.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import hypot, isfinite

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable
from pipros.safe.tolerant_xml import parse_tolerantly
from pipros.safe.xml import Element, XmlError
from pipros_libraries.transforms.pose import IDENTITY, Pose, from_roll_pitch_yaw

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

Vector = tuple[float, float, float]


class UrdfError(PiprosError, ValueError):
    """The text is not a valid URDF, or its links and joints do not form a tree."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text, 2_000))


@dataclass(frozen=True, slots=True)
class Mimic:
    """Rule for a joint that mimics another joint.

    The position of the mimicking joint is `multiplier` times the position of `joint`, plus `offset`.
    """

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Joint:
    """The connection between a link and its parent.

    Attributes:
        type: one of JOINT_TYPES.
        origin: the child's pose relative to the parent at position 0.
        axis: unit vector of the rotation or translation, in the child's frame.
        limits: minimum and maximum position in radians or metres; None if there are no limits.
        soft_limits: the safety controller's limits; None for each limit that is not set.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Pose = IDENTITY
    axis: Vector = (1.0, 0.0, 0.0)
    limits: tuple[float, float] | None = None
    soft_limits: tuple[float | None, float | None] = (None, None)
    mimic: Mimic | None = None


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot: a tree of links, with its joints in file order."""

    name: str
    links: tuple[str, ...]
    joints: tuple[Joint, ...]

    @property
    def root(self) -> str:
        """The link without a parent."""
        children = {joint.child for joint in self.joints}
        return next(link for link in self.links if link not in children)


def read_robot(text: str) -> Robot:
    """Parse a URDF.

    Raises:
        UrdfError: the text is not well-formed XML or not a valid URDF, or the links do not form a tree with
            one root.
    """
    robot = robot_element(text)
    links = tuple(required(link, "name") for link in robot.all("link"))
    joints = tuple(_joint(element) for element in robot.all("joint"))
    _check_tree(links, joints)
    return Robot(robot.attributes.get("name", ""), links, joints)


def robot_element(text: str) -> Element:
    """Return the root element of a URDF. Raise `UrdfError` if the text is not XML or not a URDF."""
    try:
        robot = parse_tolerantly(text, "robot_description")
    except XmlError as error:
        raise UrdfError(f"the robot description is not XML: {error}") from None
    if robot.tag != "robot":
        raise UrdfError(f"the robot description must have the root element <robot>, got <{robot.tag}>")
    return robot


def _joint(element: Element) -> Joint:
    name, kind = required(element, "name"), required(element, "type")
    if kind not in JOINT_TYPES:
        raise UrdfError(f"type of joint {name} must be one of {', '.join(JOINT_TYPES)}, got {kind!r}")
    parent, child = _link_of(element, name, "parent"), _link_of(element, name, "child")
    limit = element.first("limit")
    limits = None
    if limit is not None:
        limits = (_number(limit, "lower", 0.0), _number(limit, "upper", 0.0))
    safety = element.first("safety_controller")
    soft: tuple[float | None, float | None] = (None, None)
    if safety is not None:
        soft = optional_number(safety, "soft_lower_limit"), optional_number(safety, "soft_upper_limit")
    copied = element.first("mimic")
    mimic = None
    if copied is not None:
        mimic = Mimic(
            required(copied, "joint"), _number(copied, "multiplier", 1.0), _number(copied, "offset", 0.0)
        )
    return Joint(name, kind, parent, child, origin_of(element), _axis(element, name), limits, soft, mimic)


def _link_of(joint: Element, name: str, role: str) -> str:
    element = joint.first(role)
    if element is None:
        raise UrdfError(f"joint {name} must have a <{role} link=…> element")
    return required(element, "link")


def origin_of(joint: Element) -> Pose:
    """Return the pose in the element's <origin>, or IDENTITY if there is no <origin>."""
    origin = joint.first("origin")
    if origin is None:
        return IDENTITY
    return (
        *vector_of(origin, "xyz", (0.0, 0.0, 0.0)),
        *from_roll_pitch_yaw(*vector_of(origin, "rpy", (0, 0, 0))),
    )


def _axis(joint: Element, name: str) -> Vector:
    element = joint.first("axis")
    x, y, z = (1.0, 0.0, 0.0) if element is None else vector_of(element, "xyz", (1.0, 0.0, 0.0))
    length = hypot(x, y, z)
    if length == 0.0:
        if joint.attributes["type"] in ("revolute", "continuous", "prismatic"):
            raise UrdfError(f"axis of joint {name} must not be zero")
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length)


def _check_tree(links: tuple[str, ...], joints: tuple[Joint, ...]) -> None:
    for what, names in (("link", links), ("joint", [joint.name for joint in joints])):
        twice = next((name for name, count in Counter(names).items() if count > 1), None)
        if twice is not None:
            raise UrdfError(f"{what} {twice} is defined more than once")
    known, parent_of = set(links), dict[str, str]()
    for joint in joints:
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                raise UrdfError(f"joint {joint.name} has the {role} {link}, which does not exist")
        if joint.child in parent_of:
            raise UrdfError(
                f"link {joint.child} must have one parent, but joint {joint.name} adds a second parent"
            )
        parent_of[joint.child] = joint.parent
    roots = [link for link in links if link not in parent_of]
    if len(roots) != 1:
        found = " and ".join(roots) if roots else "none"
        raise UrdfError(f"exactly one link, the root, must have no parent, got {found}")
    # If there is one root, and every other link has one parent, unreachable links are in or below a cycle.
    reached, new = {roots[0]}, [roots[0]]
    children: dict[str, list[str]] = {}
    for child, parent in parent_of.items():
        children.setdefault(parent, []).append(child)
    while new:
        found_links = children.get(new.pop(), [])
        reached.update(found_links)
        new.extend(found_links)
    if len(reached) < len(links):
        raise UrdfError(f"links are in or below a cycle: {', '.join(sorted(known - reached))}")


def required(element: Element, attribute: str) -> str:
    """Return an attribute. Raise UrdfError if it is missing or empty."""
    value = element.attributes.get(attribute, "")
    if not value:
        raise UrdfError(f"line {element.line}: <{element.tag}> must have a non-empty attribute {attribute!r}")
    return value


def optional_number(element: Element, attribute: str) -> float | None:
    """Return a numeric attribute, or None if it is missing. Raise UrdfError if it is not a finite number."""
    return _number(element, attribute, 0.0) if attribute in element.attributes else None


def _number(element: Element, attribute: str, default: float) -> float:
    (value,) = numbers_of(element, attribute, 1, (default,))
    return value


def vector_of(element: Element, attribute: str, default: Vector) -> Vector:
    """Like `numbers_of`, for three numbers."""
    x, y, z = numbers_of(element, attribute, 3, default)
    return (x, y, z)


def numbers_of(element: Element, attribute: str, count: int, default: tuple[float, ...]) -> list[float]:
    """Return an attribute of `count` numbers, or the default if it is missing.

    Raise UrdfError if it does not consist of that many finite numbers.
    """
    text = element.attributes.get(attribute)
    if text is None:
        return [float(number) for number in default]
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise UrdfError(
            f"line {element.line}: {attribute} of <{element.tag}> must be {count} finite "
            f"number{'s' if count > 1 else ''}, got {text!r}"
        )
    return numbers
