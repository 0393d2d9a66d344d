"""The limits of simulations."""

from typing import NamedTuple


class SimulationLimits(NamedTuple):
    """The limits of simulations. Get them with `limits.of(SimulationLimits)`, where `limits` is a `Limits`.

    Attributes:
        turtles: maximum number of turtles in one turtlesim.
        simulated_robots: maximum number of robots, and of moving obstacles, in one simulation.
        teleports: maximum number of teleports queued for one turtle until the next tick.
    """

    turtles: int = 100
    simulated_robots: int = 100
    teleports: int = 1000
