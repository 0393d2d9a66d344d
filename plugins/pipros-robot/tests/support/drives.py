"""A simulated robot that drives through an apartment, as a sequence of messages, for tests of navigation."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipros.msg.time import Time
from pipros_libraries.nodes.wiring import stamped
from pipros_robot.navigation import plane
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.settings import Laser, RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World

RESOLUTION = 0.05
WIDTH, HEIGHT = 10.0, 8.0
WALLS = (  # x and y of two corners in metres: the walls of five rooms, and furniture
    (0.0, 0.0, 10.0, 0.1), (0.0, 7.9, 10.0, 8.0), (0.0, 0.0, 0.1, 8.0), (9.9, 0.0, 10.0, 8.0),
    (4.0, 0.0, 4.1, 1.2), (4.0, 2.2, 4.1, 3.5), (0.0, 3.4, 1.4, 3.5), (2.4, 3.4, 4.1, 3.5),
    (0.0, 4.9, 2.0, 5.0), (3.0, 4.9, 6.0, 5.0), (5.9, 4.9, 6.0, 6.0), (5.9, 7.0, 6.0, 8.0),
    (7.0, 3.4, 10.0, 3.5), (7.0, 4.9, 10.0, 5.0), (7.0, 0.0, 7.1, 1.0), (7.0, 2.0, 7.1, 3.5),
    (1.0, 0.6, 1.8, 1.4), (5.2, 0.1, 5.6, 1.0), (8.6, 1.4, 9.4, 2.0), (0.1, 6.6, 0.8, 7.9),
    (3.6, 7.0, 4.6, 7.4), (8.0, 6.3, 8.7, 7.0),
)  # fmt: skip
START = Pose(2.9, 1.0, 1.2)
ROUTE = (
    (2.9, 2.4), (1.9, 3.0), (1.9, 4.2), (2.5, 4.6), (2.5, 5.8), (5.0, 6.4), (6.6, 6.5), (7.4, 5.9),
    (6.6, 6.5), (5.0, 6.2), (2.5, 5.8), (2.5, 4.2), (5.5, 4.2), (5.5, 2.6), (6.2, 1.5), (7.8, 1.5),
    (8.0, 2.6), (7.8, 1.5), (5.5, 1.7), (3.0, 1.7), (2.9, 1.0),
)  # fmt: skip


def apartment() -> NDArray[np.bool_]:
    """Return the occupied cells, shape (rows, columns), with the row of the lowest y first."""
    cells = np.zeros((round(HEIGHT / RESOLUTION), round(WIDTH / RESOLUTION)), bool)
    for x0, y0, x1, y1 in WALLS:
        rows, columns = ((round(a / RESOLUTION), round(b / RESOLUTION)) for a, b in ((y0, y1), (x0, x1)))
        cells[slice(*rows), slice(*columns)] = True
    return cells


@dataclass(frozen=True, slots=True)
class Agreement:
    """How well a map agrees with the apartment.

    Attributes:
        free_iou: cells that are free in both, as a share of those that are free in one of them.
        walls_near: share of the occupied cells of the map at most one cell away from a wall.
        walls_seen: share of the surface of the walls at most one cell away from an occupied cell.
    """

    free_iou: float
    walls_near: float
    walls_seen: float


def agreement(values: NDArray[np.int8], origin: tuple[float, float], start: Pose) -> Agreement:
    """Compare a map (rows and columns of -1, 0, 100) whose frame is at `start` in the apartment.

    The yaw of `start` must be 0, and its position a multiple of the resolution.
    """
    walls = apartment()
    row, column = (round((-o - s) / RESOLUTION) for o, s in ((origin[1], start.y), (origin[0], start.x)))
    part = values[row : row + walls.shape[0], column : column + walls.shape[1]]
    assert part.shape == walls.shape, "the map is smaller than the apartment"
    occupied, free = part == 100, part == 0
    surface = walls & _grown(~walls)
    return Agreement(
        float((free & ~walls).sum() / (free | ~walls).sum()),
        float((occupied & _grown(walls)).sum() / occupied.sum()),
        float((surface & _grown(occupied)).sum() / surface.sum()),
    )


def _grown(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the cells that are set or have a set neighbour, also diagonally."""
    padded = np.pad(cells, 1)
    rows, columns = cells.shape
    shifts = [padded[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    found: NDArray[np.bool_] = np.any(shifts, axis=0)
    return found


def map_message(cells: NDArray[np.bool_] | None = None) -> Any:
    """Return the map of the apartment as nav_msgs/OccupancyGrid."""
    occupied = apartment() if cells is None else cells
    message = stamped("nav_msgs/OccupancyGrid", "map", Time())
    message.info.resolution = RESOLUTION
    message.info.height, message.info.width = occupied.shape
    message.info.origin.orientation.w = 1.0
    message.data = np.where(occupied, 100, 0).ravel().tolist()
    return message


@dataclass(frozen=True, slots=True)
class Moment:
    """A scan, the transforms at its time, and the true pose of the robot in the map."""

    time_s: float
    odometry: Pose
    truth: Pose
    ranges: NDArray[np.float64]


def drive(
    *,
    speed: float = 0.4,
    rays: int = 180,
    noise: float = 0.03,
    seed: int = 1,
    route: Sequence[tuple[float, float]] = ROUTE,
    start: Pose = START,
    limit_s: float = 600.0,
) -> Iterator[Moment]:
    """Drive along a route; yield ten scans a second. The map's origin is the corner of the apartment."""
    settings = RobotSettings(
        start=start, odometry_noise=noise, laser=replace(Laser(), rays=rays), max_linear=speed,
        max_angular=1.0,
    )  # fmt: skip
    simulation = Simulation(World.from_cells(apartment(), RESOLUTION), [settings], seed=seed)
    robot = simulation.robots[""]
    goals = list(route)
    while goals and simulation.time_s < limit_s:
        dx, dy = goals[0][0] - robot.pose.x, goals[0][1] - robot.pose.y
        if math.hypot(dx, dy) < 0.15:
            goals.pop(0)
            continue
        turn = math.remainder(math.atan2(dy, dx) - robot.pose.yaw, math.tau)
        robot.command(speed if abs(turn) < 0.5 else 0.0, 2.0 * turn, simulation.time_s)
        for _ in range(5):
            simulation.step()
        yield Moment(simulation.time_s, robot.odometry, robot.pose, np.array(simulation.scans([""])[""]))
    assert not goals, f"the robot is stuck at {robot.pose} on its way to {goals[0]}"


def apart(moments: Iterable[Moment], distance_m: float, turn_rad: float) -> Iterator[Moment]:
    """Yield the first moment, and the next ones after such a distance or turn of the odometry."""
    before: Pose | None = None
    distance = turn = 0.0
    for moment in moments:
        now = moment.odometry
        if before is not None:
            distance += math.hypot(now.x - before.x, now.y - before.y)
            turn += abs(math.remainder(now.yaw - before.yaw, math.tau))
        if before is None or distance >= distance_m or turn >= turn_rad:
            distance = turn = 0.0
            yield moment
        before = now


def stamp(time_s: float) -> Time:
    """Return the timestamp of a moment."""
    return Time(*divmod(round((1000.0 + time_s) * 1e9), 1_000_000_000))


def scan_message(moment: Moment) -> Any:
    """Return the scan of a moment as sensor_msgs/LaserScan, in the frame `laser`."""
    laser = replace(Laser(), rays=len(moment.ranges))
    return stamped(
        "sensor_msgs/LaserScan", "laser", stamp(moment.time_s), angle_increment=laser.increment,
        angle_max=laser.increment * (laser.rays - 1), range_min=laser.range_min, range_max=laser.range_max,
        ranges=moment.ranges.tolist(),
    )  # fmt: skip


def transform_message(parent: str, child: str, pose: Pose, time_s: float) -> Any:
    """Return a tf2_msgs/TFMessage with one transform."""
    return plane.transforms(parent, child, plane.raised((pose.x, pose.y, pose.yaw)), stamp(time_s))
