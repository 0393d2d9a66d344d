"""Client-side and server-side state machines of action goals. They use neither sockets nor a clock.

`client_goal` and `server_goal` each contain one transition table. The facade `actionlib` adds topics and
callbacks. Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""
