"""Several ROS masters joined over Zenoh: each member shares topics, services and parameters with the others.

Pure modules: `keys`, `directory`, `fleet_file`, `messages`, `outbox`, `members`. `agent` connects them to a
master and to a router. Needs the extra `fleet`, which only `zenoh_session` and `certificates` import.
"""
