"""The declaration of this room; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room("fleet", "masters joined over a network", limits="pipros.fleet.limits:FleetLimits")
