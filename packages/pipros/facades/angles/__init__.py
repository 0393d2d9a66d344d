"""Drop-in replacement for Noetic's angles: normalization and differences of angles, in radians."""

from __future__ import annotations

from math import fmod, pi

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "math:fabs")

_TURN = 2.0 * pi


def normalize_angle_positive(angle: float) -> float:
    """Normalize an angle to [0, 2 pi)."""
    return angle % _TURN


def normalize_angle(angle: float) -> float:
    """Normalize an angle to (-pi, pi]."""
    positive = normalize_angle_positive(angle)
    return positive - _TURN if positive > pi else positive


def shortest_angular_distance(from_angle: float, to_angle: float) -> float:
    """Return the shortest rotation from one angle to another, in (-pi, pi]."""
    return normalize_angle(to_angle - from_angle)


def two_pi_complement(angle: float) -> float:
    """Return the equivalent rotation in the opposite direction, in [-2 pi, 2 pi]; 2 pi for 0.

    >>> two_pi_complement(-pi / 4) == 7 * pi / 4
    True
    """
    if abs(angle) > _TURN:
        angle = fmod(angle, _TURN)
    return angle - _TURN if angle > 0 else angle + _TURN


def shortest_angular_distance_with_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """Return the shortest rotation from one angle to another that stays within limits.

    Args:
        left_limit, right_limit: limits from -pi to pi. The range extends counterclockwise from the left to
            the right limit. For example, the range from 0.25 to -0.25 excludes angles near 0.

    Returns:
        True and the rotation, or, if one of the angles is outside the range, False and the rotation that
        violates the limits least.

    >>> shortest_angular_distance_with_limits(-0.5, 0.5, 0.25, -0.25) == (True, 1.0 - 2 * pi)
    True
    """
    rotations = _rotations(from_angle, to_angle)
    is_inside, least, greatest = _rotations_to_limits(from_angle, left_limit, right_limit)
    if is_inside:
        for rotation in rotations:
            if least <= rotation <= greatest:
                return True, rotation
        _, least, greatest = _rotations_to_limits(to_angle, left_limit, right_limit)
        to_the_left = abs(least) > abs(greatest)
    else:
        to_the_left = abs(least) < abs(greatest)
    if abs(least) == abs(greatest):
        return False, rotations[0] if abs(rotations[0]) < abs(rotations[1]) else rotations[1]
    return False, min(rotations) if to_the_left else max(rotations)


def shortest_angular_distance_with_large_limits(
    from_angle: float, to_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float]:
    """Like `shortest_angular_distance_with_limits`, for joints with a range beyond -pi to pi.

    Args:
        left_limit, right_limit: limits of any size; the left limit must be less than the right limit.

    Returns:
        True and the rotation; False and the rotation that ends within the limits, if `from_angle` is outside
        the range; or False and the shorter rotation, if both rotations violate the limits or the limits are
        reversed.
    """
    shorter, longer = sorted(_rotations(from_angle, to_angle), key=abs)
    if left_limit <= right_limit:
        for rotation in (shorter, longer):
            if left_limit <= from_angle + rotation <= right_limit:
                return left_limit <= from_angle <= right_limit, rotation
    return False, shorter


def _rotations(from_angle: float, to_angle: float) -> tuple[float, float]:
    """Return the shortest rotation to an angle, and the equivalent rotation in the opposite direction."""
    shortest = shortest_angular_distance(from_angle, to_angle)
    return shortest, two_pi_complement(shortest)


def _rotations_to_limits(
    from_angle: float, left_limit: float, right_limit: float
) -> tuple[bool, float, float]:
    """Return whether an angle is within the limits, and the rotation from the angle to each limit."""
    to_left, to_right = _rotations(from_angle, left_limit), _rotations(from_angle, right_limit)
    if to_left[0] == 0:
        return True, 0.0, max(to_right)
    if to_right[0] == 0:
        return True, min(to_left), 0.0
    least, over_left = min(to_left), max(to_left)
    greatest, over_right = max(to_right), min(to_right)
    if least <= over_right or greatest >= over_left:
        return (left_limit, right_limit) == (-pi, pi), over_right, over_left
    return True, least, greatest
