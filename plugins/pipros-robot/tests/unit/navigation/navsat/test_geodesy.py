"""Projections against numerical integration and derivatives, and the transform on a simple world."""

import math
import random

import pytest

from pipros_libraries.transforms.pose import IDENTITY, Pose, from_roll_pitch_yaw
from pipros_robot.navigation.navsat.alignment import Alignment
from pipros_robot.navigation.navsat.geodesy import (
    A,
    F,
    LocalPlane,
    OutOfRange,
    from_grid,
    standard_zone,
    to_grid,
    zone_of_name,
)

E2 = F * (2 - F)


def meridian_arc(latitude: float, steps: int = 2000) -> float:
    """Return the distance from the equator along a meridian, by Simpson's rule."""
    width = math.radians(latitude) / steps
    values = [A * (1 - E2) / (1 - E2 * math.sin(i * width) ** 2) ** 1.5 for i in range(steps + 1)]
    return width / 3 * (values[0] + 4 * sum(values[1::2]) + 2 * sum(values[2:-1:2]) + values[-1])


@pytest.mark.parametrize("latitude", [-79.0, -33.3, 0.0, 1.0, 45.0, 83.9])
def test_the_central_meridian_has_its_true_length(latitude: float) -> None:
    grid = to_grid(latitude, -3.0)

    assert grid.x == pytest.approx(500_000.0, abs=1e-8)
    north = grid.y - (10_000_000.0 if latitude < 0 else 0.0)
    assert north == pytest.approx(0.9996 * meridian_arc(latitude), abs=1e-6)
    assert grid.convergence == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("place", [(52.5, 13.4), (-33.9, 151.2), (60.4, 5.3), (88.0, -70.0), (-85.0, 100.0)])
def test_the_grid_is_conformal_and_turned_by_the_convergence(place: tuple[float, float]) -> None:
    """Small steps north and east have the same scale, a right angle, and the direction of the convergence."""
    latitude, longitude = place
    grid, step = to_grid(latitude, longitude), 1e-5
    phi = math.radians(latitude)
    along = math.radians(step) * A * (1 - E2) / (1 - E2 * math.sin(phi) ** 2) ** 1.5
    across = math.radians(step) * A * math.cos(phi) / math.sqrt(1 - E2 * math.sin(phi) ** 2)

    def moved(dlat: float, dlon: float, metres: float) -> complex:
        ahead = to_grid(latitude + dlat, longitude + dlon, grid.zone)
        behind = to_grid(latitude - dlat, longitude - dlon, grid.zone)
        return complex(ahead.x - behind.x, ahead.y - behind.y) / (2 * metres)

    north, east = moved(step, 0.0, along), moved(0.0, step, across)
    assert north == pytest.approx(1j * east, abs=1e-7)
    turn = math.atan2(north.imag, north.real) - math.pi / 2
    assert math.remainder(turn - math.radians(grid.convergence), math.tau) == pytest.approx(0.0, abs=1e-7)


def test_coordinates_convert_back() -> None:
    numbers = random.Random(1)  # noqa: S311
    for _ in range(500):
        latitude, longitude = numbers.uniform(-89.9, 89.9), numbers.uniform(-180.0, 180.0)
        grid = to_grid(latitude, longitude)
        back = from_grid(grid.zone, grid.is_north, grid.x, grid.y)
        assert back[0] == pytest.approx(latitude, abs=1e-11)
        assert math.remainder(back[1] - longitude, 360.0) == pytest.approx(0.0, abs=1e-8)
        plane = LocalPlane(latitude, longitude, numbers.uniform(0.0, 3000.0))
        position = (
            numbers.uniform(-500.0, 500.0), numbers.uniform(-500.0, 500.0), numbers.uniform(-50.0, 50.0)
        )  # fmt: skip
        assert plane.forward(*plane.reverse(*position)) == pytest.approx(position, abs=1e-6)


def test_zones_have_the_exceptions_of_norway_and_svalbard() -> None:
    places = {(52.0, 13.0): 33, (60.0, 4.0): 32, (60.0, 2.0): 31, (78.0, 10.0): 33, (78.0, 8.0): 31}
    places |= {(78.0, 41.0): 37, (0.0, 180.0): 1, (0.0, -180.0): 1, (84.0, 0.0): 0, (-80.1, 0.0): 0}
    assert {place: standard_zone(*place) for place in places} == places
    assert (zone_of_name("31U"), zone_of_name("55H")) == ((31, True), (55, False))
    assert zone_of_name("Z") == (0, True)
    for name in ("", "61U", "31", "31I", "0A", "U31"):
        with pytest.raises(OutOfRange, match="such as 31U"):
            zone_of_name(name)


def test_positions_without_coordinates_are_refused() -> None:
    for place in ((91.0, 0.0), (math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(OutOfRange, match="latitude must be between -90 and 90"):
            to_grid(*place)
        with pytest.raises(OutOfRange, match="latitude must be between -90 and 90"):
            LocalPlane(*place)
        with pytest.raises(OutOfRange, match="latitude must be between -90 and 90"):
            LocalPlane(0.0, 0.0).forward(*place, 0.0)
    for zone, x, y in ((31, 1e300, 0.0), (31, math.nan, 0.0), (31, 0.0, -math.inf), (0, 0.0, 1e200)):
        with pytest.raises(OutOfRange, match=f"the coordinates in zone {zone} must be at most 2e.07 m"):
            from_grid(zone, True, x, y)
    with pytest.raises(OutOfRange, match="more than 60 degrees from the centre of UTM zone 31"):
        to_grid(0.0, 100.0, 31)
    with pytest.raises(OutOfRange, match="too far from UTM zone 31"):
        to_grid(0.0, 12.0, 31)


def test_the_world_frame_starts_at_the_robot_with_its_heading() -> None:
    """A robot at (10, 5) in its world, facing north there and east on the earth: the world is turned."""
    alignment = Alignment(is_local=True, turn=0.0)
    alignment.set_fix(50.0, 8.0, 100.0)
    assert not alignment.align(None)
    alignment.odometry = (10.0, 5.0, 0.0, *from_roll_pitch_yaw(0.1, 0.0, math.pi / 2))
    alignment.set_attitude(IDENTITY, IDENTITY)
    antenna: Pose = (2.0, 0.0, 1.0, *IDENTITY[3:])

    assert alignment.align(antenna)

    assert alignment.in_world((0.0, 0.0, 100.0)) == pytest.approx((10.0, 7.0, 1.0))
    latitude, longitude, _ = alignment.geographic((10.0, 8.0, 0.0))  # one metre further east
    east, north, _ = LocalPlane(50.0, 8.0).forward(latitude, longitude, 0.0)
    assert (east, north) == pytest.approx((1.0, 0.0), abs=1e-5)
