"""The declaration of this room; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room("bridges", "servers for rosbridge and Foxglove", limits="pipros.bridges.limits:BridgeLimits")
