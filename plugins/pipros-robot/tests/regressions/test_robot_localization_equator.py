"""robot_localization: a robot with GPS jumped by 10,000 km when it crossed the equator."""

import pytest

from pipros_libraries.transforms.pose import IDENTITY
from pipros_robot.navigation.navsat.alignment import Alignment


@pytest.mark.parametrize(("start", "ends"), [
    ((0.001, 9.0), [(-0.001, 9.0)]), ((-0.001, 9.0), [(0.001, 9.0)]),
    ((45.0, 5.999), [(45.0, 6.001)]),  # into another zone
    ((45.0, 179.999), [(45.0, -179.999), (45.0, 180.0), (45.0, -180.0), (45.0, 180.001)]),
])  # fmt: skip
def test_positions_beyond_a_border_stay_near(
    start: tuple[float, float], ends: list[tuple[float, float]]
) -> None:
    alignment = Alignment(is_local=False, turn=0.0)
    alignment.odometry = alignment.attitude = IDENTITY
    alignment.set_fix(*start, 10.0)
    assert alignment.align(None)
    for latitude, longitude in ends:
        x, y, z = alignment.in_world(alignment.in_plane(latitude, longitude, 10.0))
        assert 50.0 < x**2 + y**2 < 300.0**2
        assert z == pytest.approx(0.0, abs=1e-6)
        again = alignment.geographic((x, y, z))
        assert again[0] == pytest.approx(latitude, abs=1e-9)
        assert abs((again[1] - longitude + 180.0) % 360.0 - 180.0) < 1e-9
