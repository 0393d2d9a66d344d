"""State machines of action goals at clients and servers, without sockets or a clock.

`client_goal` and `server_goal` contain one table of transitions each. The facade `actionlib` adds topics and
callbacks.
Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""
