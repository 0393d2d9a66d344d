"""Connect ROS masters over Zenoh: each member shares topics, services and parameters with other members.

`keys`, `directory`, `fleet_file`, `messages`, `outbox`, `members` and `presence` perform no network I/O.
`agent` connects the parts to a master and a router. Only `zenoh_session` and `certificates` import the
libraries of the extra `fleet`.
"""
