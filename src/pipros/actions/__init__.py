"""The goals of actions, as clients and servers see them: state machines without sockets or a clock.

`client_goal` and `server_goal` hold one table each. The facade `actionlib` gives them topics and callbacks.
Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""
