"""The limits of simulations."""

from typing import NamedTuple


class SimulationLimits(NamedTuple):
    """The limits of simulations: `limits.of(SimulationLimits)` for a `Limits`.

    Attributes:
        turtles: turtles in one turtlesim.
        simulated_robots: robots in one simulation; also the maximum number of moving obstacles.
        teleports: teleports queued for one turtle until the next tick.
    """

    turtles: int = 100
    simulated_robots: int = 100
    teleports: int = 1000
