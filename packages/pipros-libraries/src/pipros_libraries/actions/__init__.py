"""Action goals: the state machines of clients and servers, and `goal_server`, a simple action server.

`client_goal` and `server_goal` each contain one transition table, and use neither sockets nor a clock. The
facade `actionlib` adds topics and callbacks. Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""
