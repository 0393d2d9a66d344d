"""Settings of a node that clients of dynamic_reconfigure change while it runs. Start with `server.py`."""
