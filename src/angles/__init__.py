"""angles, as Noetic has it: angles in radians, the ways between them, and limits of joints."""

from __future__ import annotations

from math import fmod, pi

from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "math:fabs")

_TURN = 2.0 * pi


def normalize_angle_positive(angle: float) -> float:
    """The same direction from 0 to 2 pi."""
    return angle % _TURN


def normalize_angle(angle: float) -> float:
    """The same direction, more than -pi and at most pi."""
    positive = normalize_angle_positive(angle)
    return positive - _TURN if positive > pi else positive


def shortest_angular_distance(from_angle: float, to_angle: float) -> float:
    """What to add to `from_angle` to look like `to_angle`: more than -pi, at most pi."""
    return normalize_angle(to_angle - from_angle)


def two_pi_complement(angle: float) -> float:
    """The turn to the same direction the other way round, from -2 pi to 2 pi; 2 pi for 0.

    >>> two_pi_complement(-pi / 4) == 7 * pi / 4
    True
    """
    if abs(angle) > _TURN:
        angle = fmod(angle, _TURN)
    return angle - _TURN if angle > 0 else angle + _TURN


def shortest_angular_distance_with_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """The turn from one angle to another that stays between limits.

    Args:
        left_limit, right_limit: from -pi to pi. Allowed is what lies between them, counterclockwise from the
            left one: from 0.25 to -0.25 that is all but what is near 0.

    Returns:
        True and the turn; False and a turn that leaves the limits by as little as possible, when one of the
        angles is outside.

    >>> shortest_angular_distance_with_limits(-0.5, 0.5, 0.25, -0.25) == (True, 1.0 - 2 * pi)
    True
    """
    ways = _ways(from_angle, to_angle)
    is_inside, least, greatest = _free_turns(from_angle, left_limit, right_limit)
    if is_inside:
        for way in ways:
            if least <= way <= greatest:
                return True, way
        _, least, greatest = _free_turns(to_angle, left_limit, right_limit)
        to_the_left = abs(least) > abs(greatest)
    else:
        to_the_left = abs(least) < abs(greatest)
    if abs(least) == abs(greatest):
        return False, ways[0] if abs(ways[0]) < abs(ways[1]) else ways[1]
    return False, min(ways) if to_the_left else max(ways)


def shortest_angular_distance_with_large_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """As `shortest_angular_distance_with_limits`, for joints that turn further than pi.

    Args:
        left_limit, right_limit: of any size, the left one less than the right one.

    Returns:
        True and the turn; False and the shorter turn when neither keeps the limits, when `from_angle` is
        outside, or when the limits are the wrong way round.
    """
    shorter, longer = sorted(_ways(from_angle, to_angle), key=abs)
    if left_limit <= right_limit:
        for way in (shorter, longer):
            if left_limit <= from_angle + way <= right_limit:
                return left_limit <= from_angle <= right_limit, way
    return False, shorter


def _ways(from_angle: float, to_angle: float) -> tuple[float, float]:
    """The shortest turn to an angle, and the one the other way round."""
    shortest = shortest_angular_distance(from_angle, to_angle)
    return shortest, two_pi_complement(shortest)


def _free_turns(from_angle: float, left_limit: float, right_limit: float) -> tuple[bool, float, float]:
    """Whether an angle is between the limits, and how far it can be turned to each of them."""
    to_left, to_right = _ways(from_angle, left_limit), _ways(from_angle, right_limit)
    if to_left[0] == 0:
        return True, 0.0, max(to_right)
    if to_right[0] == 0:
        return True, min(to_left), 0.0
    least, over_left = min(to_left), max(to_left)
    greatest, over_right = max(to_right), min(to_right)
    if least <= over_right or greatest >= over_left:
        return (left_limit, right_limit) == (-pi, pi), over_right, over_left
    return True, least, greatest
