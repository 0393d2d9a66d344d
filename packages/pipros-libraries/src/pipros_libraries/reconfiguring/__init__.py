"""Settings of a node that clients of dynamic_reconfigure can change at run time. Start with `server.py`."""
