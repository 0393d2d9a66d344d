"""The declaration of this room; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room(
    "simulation", "turtlesim, and robots in a flat world", limits="pipros.simulation.limits:SimulationLimits"
)
