"""Executables of the rosbridge_server package: rosbridge servers for WebSockets, TCP and UDP."""
