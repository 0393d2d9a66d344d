"""The declaration of this room; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room("web", "the page of the rqt commands and rviz", limits="pipros.web.limits:PageLimits")
