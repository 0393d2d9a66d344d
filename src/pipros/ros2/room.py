"""The declaration of this room; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room("ros2", "the gateway to ROS 2", limits="pipros.ros2.limits:Ros2Limits")
