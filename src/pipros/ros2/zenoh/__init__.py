"""The engine for rmw_zenoh, on eclipse-zenoh (the extra `zenoh`).

Keys, tokens and attachments are those of rmw_zenoh's design document
(https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md).
"""
