"""Nodes in a browser tab: sockets, timers and event loops for Pyodide, which has no threads or sockets."""
