"""The engine for rmw_zenoh, based on eclipse-zenoh (the extra `zenoh`).

Keys, liveliness tokens and attachments follow rmw_zenoh's design document
(https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md).
"""
